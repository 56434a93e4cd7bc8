"""One run on the command line: compute it, and show what came out as a table or as a line of JSON."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.comparison import comparison_lines
from fracctl.cli.failure import sentence
from fracctl.cli.laws import implementation_lines, law_lines, quantile_lines, survival_lines
from fracctl.cli.parser import Parser
from fracctl.cli.progress import display
from fracctl.cli.table import ResultTable
from fracctl.errors import FracctlError

if TYPE_CHECKING:
    from fracctl.config.command import Command
    from fracctl.config.schemas import RunConfig
    from fracctl.execution.perform import RunResult
    from fracctl.execution.progress import Progress
    from fracctl.store import RunDirectory
    from fracctl.units import Scales

MOST_DESIGN_VARIABLES = 10
"""Of a law with more parameters, the table shows those that the survey varies."""

_KEYS = (
    *("experiment", "run_id", "run_directory", "status", "reused"),
    *("optimum", "baseline", "change_percent", "error"),
)


@dataclass(frozen=True)
class Job:
    """One run of the command line."""

    config: RunConfig
    command: Command | None = None
    """Whose words lead to it; None where a stored run is continued."""
    label: str = ""
    """``run 2 of 3 (experiment=…): ``, empty for a single run."""
    varied: Mapping[str, str] = field(default_factory=dict)
    """What a sweep sets in this run: values by key."""
    scales: Scales | None = None
    """Of the plant."""
    further: Mapping[str, Any] = field(default_factory=dict)
    """What its line of JSON holds beside the summary."""
    directory: RunDirectory | None = None
    """Where it is stored; None for where its configuration says."""


@dataclass(frozen=True)
class Ended:
    """What became of a job."""

    summary: Mapping[str, Any] | None
    """None where there is no result."""
    problem: Exception | None = None
    """What went wrong."""
    status: str = "failed"
    """Where there is no result."""


def add_display_options(parser: Parser) -> None:
    """Add --json and --quiet."""
    parser.add_json("one JSON object a line for each run")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error, no notes")


def compute_and_show(job: Job, options: argparse.Namespace, compute: Callable[[Progress], RunResult]) -> Ended:
    """Compute one run and show it."""
    try:
        progress = display(job.label.removesuffix(": ") or job.config.name, options.quiet)
        summary = compute(progress).summary
    except Exception as error:  # noqa: BLE001 - the other runs go on
        if options.json:
            output.say_json({**_failure(job, error), **job.further})
        return Ended(None, error)
    _show(summary, job, options)
    return Ended(summary, FracctlError(str(summary["error"])) if summary.get("error") else None)


def _show(summary: dict[str, Any], job: Job, options: argparse.Namespace) -> None:
    if options.json:
        output.say_json({**summary, **job.further})
        return
    stored = ", stored already" if summary.get("reused") else ""
    output.say(f"{summary['experiment']}{stored}{lacking(summary)}")
    for line in _lines(summary, job.config):
        output.say(line)
    for note in () if options.quiet else summary.get("notes") or ():
        output.say(f"note: {note}")
    output.say(str(summary["run_directory"]))


def lacking(summary: Mapping[str, Any]) -> str:
    """Return what stands behind a run's name if its result lacks something: ``, incomplete: 9 points missing``."""
    from fracctl.execution.summary import missing

    status = summary.get("status")
    return "" if status == "finished" else f", {missing(summary.get('failed_points')) or status}"


def _lines(summary: dict[str, Any], config: RunConfig) -> list[str]:
    tables = summary.get("tables", {})
    if "comparison" in tables:
        return comparison_lines(tables["comparison"], config.objectives[config.objective] == ["settling_time"])
    if "laws" in tables:
        return law_lines(tables["laws"]) + survival_lines(tables.get("survival", []))
    if "survival" in tables:
        return survival_lines(tables["survival"]) + implementation_lines(tables.get("implementations", []))
    if "quantiles" in tables:
        return quantile_lines(tables["quantiles"])
    return _table(config).lines(summary)


def _table(config: RunConfig) -> ResultTable:
    """A table without the many gains of a large plant that the survey leaves alone."""
    survey, controller = config.survey.model_dump(), config.controller.model_dump(exclude={"type"})
    unvaried = [name for name in controller if name not in survey.get("axes", {})]
    hidden = unvaried if len(controller) > MOST_DESIGN_VARIABLES and survey["type"] in ("single", "grid") else []
    return ResultTable(config.objectives, hidden, "result" if survey["type"] in ("single", "lqr_seed") else "optimum")


def _failure(job: Job, error: Exception) -> dict[str, Any]:
    """The JSON of a run that gave no result; its directory, where there is one, holds what was computed and the log."""
    from fracctl.store import directory_of
    from fracctl.store.identity import run_id

    plain = job.config.model_dump(mode="json")
    directory = job.directory or directory_of(plain)
    stored = str(directory.path) if directory.path.is_dir() else None
    found: dict[str, Any] = {"experiment": job.config.name, "run_id": run_id(plain), "run_directory": stored}
    found |= {"status": "failed", "reused": False, "error": sentence(error)}
    return {key: found.get(key) for key in _KEYS}
