"""`fracctl list`: groups, options, experiments, stored runs."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.cli.table import table
from fracctl.errors import UsageError, suggestion
from fracctl.report.numbers import number

if TYPE_CHECKING:
    from fracctl.config.catalogue import Catalogue

SUMMARY = "list experiments, groups, the options of a group, or stored runs"

_DESCRIPTION = """\
List what a run can be composed of, or the runs that are stored.

Without argument: the experiments and all groups. With the name of a group: its options. 'runs' lists the runs below
outputs/, or below DIR with output_dir=DIR."""

_EXAMPLES = """\
  fracctl list                       experiments and groups
  fracctl list controller            the options of a group, chosen by controller=NAME
  fracctl list experiments           chosen by experiment=NAME
  fracctl list runs output_dir=work  runs stored below work/"""


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("list", "[GROUP | experiments | runs]", _DESCRIPTION, _EXAMPLES)
    parser.add_argument("what", nargs="*", metavar="GROUP", help="a group, 'experiments', or 'runs'")
    parser.add_config_dir()
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    from fracctl.config.catalogue import catalogue

    words: list[str] = options.what
    if words[:1] == ["runs"]:
        _list_runs(_output_directory(words[1:]))
        return 0
    if len(words) > 1:
        raise UsageError(f"'list' takes one group, not '{' '.join(words)}'")
    found = catalogue(options.config_dir)
    if not words:
        _list_everything(found)
        return 0
    group = "experiment" if words[0] == "experiments" else words[0]
    if group not in found.groups():
        known = [*found.groups(), "experiments", "runs"]
        hint = suggestion(group, known) or f"; groups: {', '.join(found.groups())}"
        raise UsageError(f"there is no group '{group}'{hint}")
    _list_options(found, group)
    return 0


def _list_everything(found: Catalogue) -> None:
    output.say("experiments, for 'fracctl run experiment=NAME':")
    for line in table([[name, _first_sentence(found, name)] for name in found.options("experiment")]):
        output.say(line)
    output.say()
    output.say("groups, for GROUP=NAME on the command line:")
    groups = [group for group in found.groups() if group != "experiment"]
    for line in table([[group, ", ".join(found.options(group))] for group in groups]):
        output.say(line)
    output.say()
    output.say("'fracctl list GROUP' explains the options of a group, 'fracctl list runs' names stored runs")


def _list_options(found: Catalogue, group: str) -> None:
    for line in table([[option, found.summary(group, option)] for option in found.options(group)]):
        output.say(line)


def _first_sentence(found: Catalogue, experiment: str) -> str:
    return found.summary("experiment", experiment).partition(". ")[0].rstrip(".")


def _output_directory(words: Sequence[str]) -> Path:
    if not words:
        return Path("outputs")
    key, _, value = words[0].partition("=")
    if len(words) > 1 or key != "output_dir" or not value:
        raise UsageError(f"'list runs' takes output_dir=DIR only, not '{' '.join(words)}'")
    return Path(value)


def _list_runs(directory: Path) -> None:
    runs = [_run(path) for path in directory.glob("*/*/run.json")]
    rows = sorted(row for row in runs if row is not None)
    if not rows:
        output.remark(f"no runs below '{directory}'")
        return
    for line in table([["started", "status", "result", "directory"], *rows], indent=""):
        output.say(line)


def _run(path: Path) -> list[str] | None:
    """Start, status, result and directory of a run; None for a file that is not a run's."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        started = str(content["provenance"]["started"])
        return [started, str(content["status"]), _result(content), str(path.parent)]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _result(content: Any) -> str:
    objective = content["configuration"]["objective"]
    optimum = (content.get("summary") or {}).get("optimum") or {}
    return f"{objective} {number(optimum.get('objective'))}" if optimum else ""
