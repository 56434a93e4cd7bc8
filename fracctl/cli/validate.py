"""`fracctl validate`: is a configuration, or a stored run, in order?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.cli.table import count
from fracctl.errors import ConfigurationError, RunError

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
    parser = Parser("validate", "[STUDY] [OVERRIDE …] | RUN_DIR", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides(help="as for 'fracctl run', or the directory of a stored run")
    parser.add_config_dir()
    parser.add_json("one JSON object: whether it is valid, and what is wrong")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    words: list[str] = options.overrides
    stored = len(words) == 1 and "=" not in words[0] and Path(words[0]).is_dir()
    try:
        found, sentence = _run(Path(words[0])) if stored else _configuration(words, options.config_dir)
    except (ConfigurationError, RunError) as error:
        if options.json:
            output.say_json({"valid": False, "problems": str(error).splitlines()})
        raise
    if options.json:
        output.say_json({"valid": True, "problems": [], **found})
    else:
        output.say(f"valid: {sentence}")
    return 0


def _configuration(words: list[str], config_dir: Path | None) -> tuple[dict[str, Any], str]:
    """Return what is found, as data and in words."""
    from fracctl.cli.words import extent
    from fracctl.config.build import build_checked
    from fracctl.config.compose import compose

    config = compose(words, config_dir)
    evaluation, survey = build_checked(config)
    names = list(evaluation.initial_conditions)
    found = {"name": config.name, "points": survey.n_points, "initial_conditions": names}
    return found, f"{config.name}, {extent(survey)}, {count(len(names), 'initial condition')}"


def _run(path: Path) -> tuple[dict[str, Any], str]:
    from fracctl.store import RunDirectory

    directory = RunDirectory(path)
    status = directory.run_json.get("status")
    if not directory.has_manifest:
        raise RunError(f"{path} is not finished (status {status}); the command that started it continues it")
    damage = directory.verify()
    if damage:
        raise RunError("\n".join(damage))
    found = {"run_directory": str(directory.path), "status": status}
    return found, f"{path} is {status}, and every file is as it was written"
