"""`fracctl validate`: is a configuration, or a stored run, in order?"""

from __future__ import annotations

import argparse
from pathlib import Path

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.errors import RunError
from fracctl.report.numbers import count

SUMMARY = "check a configuration, or the files of a stored run, without computing"

_DESCRIPTION = """\
Compose a run and check everything that can be wrong with it, or compare the files of a stored run with the digests in
its manifest. Computes nothing; the exit code is 0 if all is well, 3 for a wrong configuration, 1 for a damaged run."""

_EXAMPLES = """\
  fracctl validate experiment=ic1_outofplane survey.axes.alpha_w=0.7:1:0.05
  fracctl validate --config-dir mine experiment=my_experiment
  fracctl validate outputs/ic1_outofplane/0123456789ab"""


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("validate", "[OVERRIDE … | RUN_DIR]", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides(help="as for 'fracctl run', or the directory of a stored run")
    parser.add_config_dir()
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    words: list[str] = options.overrides
    if len(words) == 1 and "=" not in words[0] and Path(words[0]).is_dir():
        return _validate_run(Path(words[0]))
    from fracctl.config.build import build_checked
    from fracctl.config.compose import compose
    from fracctl.report.words import extent

    config = compose(words, options.config_dir)
    evaluation, survey = build_checked(config)
    conditions = count(len(evaluation.initial_conditions), "initial condition")
    output.say(f"valid: {config.name}, {extent(survey)}, {conditions}")
    return 0


def _validate_run(path: Path) -> int:
    from fracctl.store import RunDirectory

    directory = RunDirectory(path)
    status = directory.run_json.get("status")
    if not directory.has_manifest:
        raise RunError(f"{path} is not finished (status {status}); the command that started it continues it")
    damage = directory.verify()
    if damage:
        raise RunError("\n".join(damage))
    output.say(f"valid: {path} is {status}, and every file is as it was written")
    return 0
