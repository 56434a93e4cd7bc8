"""`fracctl compare`: laws, optima or whole runs in one table."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.failure import report
from fracctl.cli.laws import law_lines
from fracctl.cli.parser import Parser
from fracctl.cli.run_word import names_run
from fracctl.cli.showing import lacking
from fracctl.errors import FracctlError, RunError, UsageError

if TYPE_CHECKING:
    from fracctl.config.schemas import RunConfig

SUMMARY = "put laws, optima or stored runs beside each other in one table"

_DESCRIPTION = """\
Put the results of several runs beside each other: a column for each law or optimum, a row for each gain and measure.

Words are directories of stored runs; or studies and overrides, in which values separated by commas give one run each,
as for 'fracctl run -m'. Runs that are not stored yet are computed first."""

_EXAMPLES = """\
  fracctl compare controller=pd,pd_lag,pid                  three laws, each with the gains of its file
  fracctl compare my_study my_other_study                   all laws of two studies
  fracctl compare my_study evaluation.period_s=10,60        a study at two sample periods
  fracctl compare outputs/ic1_outofplane/*                  stored runs"""

_NOT_SHOWN = ("law_number", "stable", "error_estimate", "nodes", "principal_poles", "all_poles_found")
_RUN_STATUS = "run_status"
_OF_RUN = ("run_directory", _RUN_STATUS)
_RESULTS = ("optimum", "baseline")


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("compare", "RUN_DIR… | [STUDY…] [OVERRIDE …]", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides(help="directories of stored runs; or studies and overrides, several values as key=a,b,c")
    parser.add_config_dir()
    parser.add_json("one JSON object a line for each column of the table")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    if not options.overrides:
        raise UsageError("'compare' needs something to compare: directories of runs, studies, or values as key=a,b")
    stored = [word for word in options.overrides if _is_run(word)]
    others = [word for word in options.overrides if word not in stored]
    summaries = [(_label(Path(word)), _stored(Path(word))) for word in stored]
    if others:
        summaries += _computed(others, options)
    records = list(_records(summaries))
    if not records:
        raise RunError("none of these runs has an optimum or laws to compare")
    if options.json:
        for record in records:
            output.say_json(record)
    else:
        shown = [{name: value for name, value in record.items() if name not in _OF_RUN} for record in records]
        for line in law_lines(shown):
            output.say(line)
    unsound = [(label, summary) for label, summary in summaries if summary["status"] != "finished"]
    for label, summary in unsound:
        report(RunError(str(summary["error"] or summary["status"])), options.debug, f"{label}: ")
    return 1 if unsound else 0


def _is_run(word: str) -> bool:
    """Whether a word names a run; other directories are refused, where no study has their name."""
    if not names_run(word):
        return False
    if not (Path(word) / "run.json").is_file():
        raise UsageError(f"'{word}' holds no run; name directories that hold run.json ('fracctl list runs')")
    return True


def _label(path: Path) -> str:
    whole = path.absolute()
    return f"{whole.parent.name}/{whole.name}"


def _stored(path: Path) -> Mapping[str, Any]:
    from fracctl.store import RunDirectory

    directory = RunDirectory(path)
    summary = directory.run_json.get("summary")
    if not summary:
        raise RunError(
            f"'{path}' is not finished (status {directory.status}); the command that started it continues it"
        )
    return {**summary, "run_directory": str(directory.path)}


def _computed(words: Sequence[str], options: argparse.Namespace) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield label and summary of every run that studies and overrides ask for."""
    from fracctl.cli.progress import display
    from fracctl.config.build import build_checked
    from fracctl.config.command import Command
    from fracctl.config.compose import compose, expand_multirun
    from fracctl.config.studies import study_file
    from fracctl.execution.executors import Executors
    from fracctl.execution.run import execute as execute_run

    studies = [word for word in words if study_file(word) is not None]
    overrides = [word for word in words if word not in studies]
    jobs: list[tuple[str, RunConfig, Command]] = []
    for chosen in [[study] for study in studies] or [[]]:
        for job in expand_multirun([*chosen, *overrides], options.config_dir):
            varied = [word for word in job if word not in overrides and (word not in chosen or len(studies) > 1)]
            config = compose(job, options.config_dir)
            build_checked(config)
            jobs.append((" ".join(varied), config, Command.of(job, options.config_dir)))
    with Executors() as executors:
        for label, config, command in jobs:
            summary = execute_run(
                config,
                command=command,
                progress=display(label or config.name, options.quiet),
                executors=executors,
            ).summary
            if summary.get("error"):
                raise FracctlError(f"{label or config.name}: {summary['error']}")
            yield label, summary


def _records(summaries: Sequence[tuple[str, Mapping[str, Any]]]) -> Iterator[dict[str, Any]]:
    """Yield the columns of the table: `initial_condition`, `law` (what stands above it), what is of the run, values."""
    alone = len(summaries) == 1
    for label, summary in summaries:
        where = {"run_directory": summary["run_directory"], _RUN_STATUS: summary["status"]}
        lacks = lacking(summary)
        laws = summary.get("tables", {}).get("laws", ())
        for row in laws:
            head = {"initial_condition": row["initial_condition"], "law": _head(label, row["law"], lacks)}
            yield head | where | {name: value for name, value in row.items() if name not in head}
        for result in () if laws else _primary(summary):
            for kind in _RESULTS:
                point = result[kind]
                if point is not None and not (kind == "baseline" and point == result["optimum"]):
                    word = kind if alone or kind == "baseline" else ""
                    head = {"initial_condition": result["initial_condition"], "law": _head(label, word, lacks)}
                    yield head | where | _values(point)


def _head(label: str, word: str, lacks: str) -> str:
    return (" ".join(filter(None, (label, word))) or "result") + lacks


def _primary(summary: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The results of the primary objective, one for each initial condition."""
    optima: list[Mapping[str, Any]] = summary.get("optima") or []
    return [result for result in optima if result["objective_name"] == optima[0]["objective_name"]]


def _values(point: Mapping[str, Any]) -> dict[str, Any]:
    hidden = {"initial_condition", "objective", *_NOT_SHOWN}
    return {name: v for name, v in point.items() if name not in hidden and not name.startswith("objective_")}
