"""`fracctl list`: groups, options, experiments, stored runs."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.cli.table import table
from fracctl.errors import UsageError, suggestion
from fracctl.report.numbers import count, number

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
    parser.add_json("one JSON object a line for each option or run")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    from fracctl.config.catalogue import catalogue

    words: list[str] = options.what
    if words[:1] == ["runs"]:
        _list_runs(_output_directory(words[1:]), options.json)
        return 0
    if len(words) > 1:
        raise UsageError(f"'list' takes one group, not '{' '.join(words)}'")
    found = catalogue(options.config_dir)
    if not words and not options.json:
        _list_everything(found)
        return 0
    group = {"experiments": "experiment"}.get(words[0], words[0]) if words else ""
    if words and group not in found.groups():
        known = [*found.groups(), "experiments", "runs"]
        hint = suggestion(group, known) or f"; groups: {', '.join(found.groups())}"
        raise UsageError(f"there is no group '{group}'{hint}")
    if options.json:
        for each in [group] if words else found.groups():
            _say_options(found, each)
    else:
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
    def summary(option: str) -> str:
        return _first_sentence(found, option) if group == "experiment" else found.summary(group, option)

    for line in table([[option, summary(option)] for option in found.options(group)]):
        output.say(line)


def _say_options(found: Catalogue, group: str) -> None:
    for option in found.options(group):
        file = found.file(f"{group}/{option}")
        output.say_json({"group": group, "name": option, "summary": found.summary(group, option), "file": str(file)})


def _first_sentence(found: Catalogue, experiment: str) -> str:
    return found.summary("experiment", experiment).partition(". ")[0].rstrip(".")


def _output_directory(words: Sequence[str]) -> Path:
    if not words:
        return Path("outputs")
    key, _, value = words[0].partition("=")
    if len(words) > 1 or key != "output_dir" or not value:
        raise UsageError(f"'list runs' takes output_dir=DIR only, not '{' '.join(words)}'")
    return Path(value)


def _list_runs(directory: Path, as_json: bool) -> None:
    found = [run for path in directory.glob("*/*/run.json") if (run := _run(path)) is not None]
    found.sort(key=lambda run: str(run["started"]))
    if as_json:
        for run in found:
            output.say_json(run)
    elif not found:
        output.remark(f"no runs below '{directory}'")
    else:
        rows = [[_age(str(run["started"])), _word(run), _result(run), str(run["directory"])] for run in found]
        for line in table([["age", "status", "result", "directory"], *rows], indent=""):
            output.say(line)


def _run(path: Path) -> dict[str, Any] | None:
    """What is told of a run; None for a file that is not a run's."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        summary = content.get("summary") or {}
        datetime.fromisoformat(content["provenance"]["started"])
        return {
            "directory": str(path.parent),
            "experiment": path.parent.parent.name,
            "run_id": path.parent.name,
            "status": _status(content, path.parent),
            "failed_points": summary.get("failed_points") or 0,
            "started": content["provenance"]["started"],
            "objective": content["configuration"]["objective"],
            "value": (summary.get("optimum") or {}).get("objective"),
            "laws": list(dict.fromkeys(row["law"] for row in (summary.get("tables") or {}).get("laws", ()))),
            "error": content.get("error"),
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _status(content: Any, directory: Path) -> str:
    """Status of a run; ``stopped`` where nobody computes what should be running."""
    from fracctl.store.lock import holder

    status = str(content["status"])
    gone = status == "running" and holder(directory.with_name(f".{directory.name}.lock")) is None
    return "stopped" if gone else status


def _word(run: dict[str, Any]) -> str:
    """Status of a run, with what its result lacks."""
    failed = run["failed_points"]
    lacks = failed and run["status"] == "incomplete"
    return f"{run['status']}, {count(failed, 'point')} missing" if lacks else str(run["status"])


def _result(run: dict[str, Any]) -> str:
    if run["laws"]:
        return ", ".join(run["laws"])
    if run["value"] is not None:
        return f"{run['objective']} {number(run['value'])}"
    return str(run["error"] or "").partition("\n")[0]


def _age(started: str) -> str:
    """How long ago a run was started: ``5 min``, ``3 h``, ``12 days``."""
    then = datetime.fromisoformat(started)
    seconds = (datetime.now(UTC) - (then if then.tzinfo else then.replace(tzinfo=UTC))).total_seconds()
    if seconds < 90.0:
        return f"{max(seconds, 0.0):.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.0f} h" if seconds < 129600.0 else f"{seconds / 86400.0:.0f} days"
