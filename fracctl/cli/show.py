"""`fracctl show`: a composed run in words and units."""

from __future__ import annotations

import argparse

from fracctl.cli import output
from fracctl.cli.parser import Parser

SUMMARY = "explain a composed run in words and units, without computing"

_DESCRIPTION = """\
Explain what a run would compute: the plant and its units, the law, the initial conditions, what is measured, which
design points, where the results are stored. Computes nothing."""

_EXAMPLES = """\
  fracctl show                                                   what 'fracctl run' does
  fracctl show experiment=outofplane
  fracctl show plant=hcw_in_plane controller=pd_alpha_in_plane"""


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("show", "[STUDY] [OVERRIDE …]", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides()
    parser.add_config_dir()
    parser.add_json("one JSON object with the words and the configuration")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    from fracctl.cli.table import table
    from fracctl.config.build import build_checked
    from fracctl.config.compose import compose
    from fracctl.report.words import explain, parts

    config = compose(options.overrides, options.config_dir)
    evaluation, survey = build_checked(config)
    if options.json:
        output.say_json({"name": config.name, **parts(config, evaluation, survey)})
        return 0
    for line in [config.name, *table(explain(config, evaluation, survey))]:
        output.say(line)
    return 0
