"""`fracctl validate`: is a configuration, or a stored run, in order?"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.cli.run_word import names_run
from fracctl.errors import ConfigurationError, RunError
from fracctl.report.numbers import count

if TYPE_CHECKING:
    from fracctl.store import RunDirectory

_MOST_LINES = 5

SUMMARY = "check a configuration, or the files of a stored run, without computing"

_DESCRIPTION = """\
Compose a run and check everything that can be wrong with it; or verify every file of a stored run, and say what is
missing, damaged or failed, and what cures it. Computes nothing; the exit code is 0 if all is well, 3 for a wrong
configuration, 1 for a run that is damaged or not finished."""

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
    stored = len(words) == 1 and names_run(words[0])
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
    from fracctl.config.build import build_checked
    from fracctl.config.compose import compose
    from fracctl.report.words import extent

    config = compose(words, config_dir)
    evaluation, survey = build_checked(config)
    names = list(evaluation.initial_conditions)
    found = {"name": config.name, "points": survey.n_points, "initial_conditions": names}
    return found, f"{config.name}, {extent(survey)}, {count(len(names), 'initial condition')}"


def _run(path: Path) -> tuple[dict[str, Any], str]:
    from fracctl.store import RunDirectory

    directory = RunDirectory(path)
    content = directory.run_json
    damage = directory.verify() if directory.has_manifest else []
    problems = [f"{path}: {line}" for line in damage] or list(_unfinished(path, directory, content))
    if problems:
        raise RunError("\n".join([*problems, _cure(path, directory)]))
    found = {"run_directory": str(directory.path), "status": content["status"]}
    return found, f"{path} is finished, and every file is as it was written"


def _unfinished(path: Path, directory: RunDirectory, content: Mapping[str, Any]) -> Iterator[str]:
    """Yield what an undamaged run lacks."""
    from fracctl.store.inspection import inspect

    status = content.get("status")
    if directory.has_manifest and status == "finished":
        return
    found = inspect(directory.parts)
    of_all = _of_all(directory)
    reason = f"; {content['error']}" if content.get("error") else ""
    yield f"{path} {_state(directory, status)}: {count(found.points, 'point')}{of_all} stored{reason}"
    yield from _some(f"{path}: parts/{name} cannot be trusted: {why}" for name, why in found.damaged.items())
    yield from _some(f"{path}: the points of parts/{name} failed: {why}" for name, why in found.failed.items())


def _state(directory: RunDirectory, status: object) -> str:
    if process := directory.computed_by:
        return f"is being computed by process {process}"
    if status in ("running", "finished"):
        return "was stopped in the middle"
    return f"is {status}" if status == "incomplete" else f"has {status}" if status == "failed" else f"was {status}"


def _of_all(directory: RunDirectory) -> str:
    """`` of 9``, empty where only the run itself can tell."""
    from fracctl.config.build import build_checked
    from fracctl.config.schemas import RunConfig
    from fracctl.execution.resuming import obstacle

    if obstacle(directory):
        return ""
    _, survey = build_checked(RunConfig.model_validate(directory.configuration))
    return f" of {survey.n_points}" if survey.n_points else ""


def _some(lines: Iterable[str]) -> Iterator[str]:
    """The first few lines, and how many more there are."""
    found = list(lines)
    yield from found[:_MOST_LINES]
    if len(found) > _MOST_LINES:
        yield f"and {len(found) - _MOST_LINES} further parts"


def _cure(path: Path, directory: RunDirectory) -> str:
    from fracctl.execution.resuming import obstacle

    if directory.computed_by:
        return "wait for it, or stop it by Ctrl-C; what is stored is kept"
    reason = obstacle(directory)
    return f"it cannot be continued: {reason}" if reason else f"'fracctl resume {path}' computes what is missing"
