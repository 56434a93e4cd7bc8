"""`fracctl run`: compose, validate, compute, and show what came out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.comparison import comparison_lines
from fracctl.cli.failure import report, sentence
from fracctl.cli.laws import law_lines, quantile_lines, survival_lines
from fracctl.cli.parser import Parser
from fracctl.cli.table import ResultTable
from fracctl.errors import ConfigurationError, FracctlError

if TYPE_CHECKING:
    from fracctl.config.schemas import RunConfig
    from fracctl.execution.executors import Executors

SUMMARY = "compute an experiment, or a run composed from options; store it and draw its figures"

_DESCRIPTION = """\
Compute a run and store it below outputs/. Without overrides: one out-of-plane PD^α loop from IC1.

The result is a short table, and as the last line the run's directory. A run that is stored already is not computed
again; one that was interrupted continues. With -m, values separated by commas give one run each; all of them are
composed and checked before the first one starts."""

_EXAMPLES = """\
  fracctl run experiment=ic1_outofplane                           the best gains and order from IC1
  fracctl run my_study                                            the file my_study.yaml, which 'fracctl init' writes
  fracctl run experiment=ic1_outofplane objective=st_os_u         for another objective
  fracctl run controller.alpha_w=0.91 controller.k_p_w=0.85       one design point
  fracctl run survey=out_of_plane survey.axes.alpha_w=0.9:1:0.02  another axis, both ends included
  fracctl run initial_condition=own initial_condition.own.units=si initial_condition.own.w=100
  fracctl run -m experiment=ic1_outofplane,ic2_outofplane --json  two runs, a line of JSON each
  fracctl run experiment=outofplane --cfg job                     print the configuration only"""


MOST_DESIGN_VARIABLES = 10
"""Of a law with more parameters, the table shows those that the survey varies."""

_KEYS = (
    *("experiment", "run_id", "run_directory", "status", "reused"),
    *("optimum", "baseline", "change_percent", "error"),
)


@dataclass(frozen=True)
class _Job:
    """One run of the command line."""

    config: RunConfig
    label: str
    """``run 2 of 3 (experiment=…): ``, empty for a single run."""


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("run", "[STUDY] [OVERRIDE …]", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides()
    parser.add_argument("-m", "--multirun", action="store_true", help="one run for each of the values key=a,b,c")
    parser.add_argument(
        "--cfg", choices=["job"], metavar="job", help="'--cfg job' prints the resolved configuration and exits"
    )
    parser.add_config_dir()
    parser.add_json("one JSON object a line for each run")
    parser.add_argument("--fresh", action="store_true", help="compute again what is stored already")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error, no notes")
    parser.add_argument("--fail-fast", action="store_true", help="with -m: do not start further runs after a failure")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    jobs = _jobs(options)
    if options.cfg:
        from fracctl.config.compose import to_yaml

        output.say("---\n".join(to_yaml(job.config) for job in jobs).rstrip())
        return 0
    from fracctl.execution.executors import Executors

    failures: list[tuple[_Job, Exception]] = []
    with Executors() as executors:
        for job in jobs:
            problem = _run(job, options, executors)
            if problem is not None:
                failures.append((job, problem))
                if options.fail_fast:
                    break
    return _report(failures, options, several=len(jobs) > 1)


def _jobs(options: argparse.Namespace) -> list[_Job]:
    """Compose and validate every run."""
    from fracctl.config.build import build_checked
    from fracctl.config.compose import compose, expand_multirun
    from fracctl.config.messages import InvalidConfiguration

    overrides: list[str] = options.overrides
    if not options.multirun:
        config = compose(overrides, options.config_dir)
        build_checked(config)
        return [_Job(config, "")]
    jobs: list[_Job] = []
    problems: list[tuple[str, str]] = []
    expanded = expand_multirun(overrides, options.config_dir)
    for place, words in enumerate(expanded, start=1):
        varied = [word for word in words if word not in overrides]
        label = f"run {place} of {len(expanded)} ({' '.join(varied)}): " if len(expanded) > 1 else ""
        try:
            config = compose(words, options.config_dir)
            build_checked(config)
            jobs.append(_Job(config, label))
        except ConfigurationError as error:
            problems += [(label, line) for line in str(error).splitlines()]
    if problems:
        raise InvalidConfiguration(_merged(problems, len(expanded)))
    return jobs


def _merged(problems: Sequence[tuple[str, str]], n_jobs: int) -> list[str]:
    """Return label and text of each problem; those that all runs share are told once."""
    texts = [text for _, text in problems]
    shared = [text for text in dict.fromkeys(texts) if texts.count(text) == n_jobs]
    return shared + [label + text for label, text in problems if text not in shared]


def _run(job: _Job, options: argparse.Namespace, executors: Executors) -> Exception | None:
    """Compute one run and show it; return what went wrong."""
    from fracctl.cli.progress import display
    from fracctl.execution.run import execute as execute_run

    try:
        progress = display(job.label.removesuffix(": ") or job.config.name, options.quiet)
        summary = execute_run(job.config, fresh=options.fresh, progress=progress, executors=executors).summary
    except Exception as error:  # noqa: BLE001 - the other runs go on
        if options.json:
            output.say_json(_failure(job.config, error))
        return error
    _show(summary, job, options)
    return FracctlError(str(summary["error"])) if summary.get("error") else None


def _show(summary: dict[str, Any], job: _Job, options: argparse.Namespace) -> None:
    if options.json:
        output.say_json(summary)
        return
    stored = ", stored already" if summary.get("reused") else ""
    output.say(f"{summary['experiment']}{stored}")
    for line in _lines(summary, job.config):
        output.say(line)
    for note in () if options.quiet else summary.get("notes") or ():
        output.say(f"note: {note}")
    output.say(str(summary["run_directory"]))


def _lines(summary: dict[str, Any], config: RunConfig) -> list[str]:
    tables = summary.get("tables", {})
    if "comparison" in tables:
        return comparison_lines(tables["comparison"], config.objectives[config.objective] == ["settling_time"])
    if "laws" in tables:
        return law_lines(tables["laws"]) + survival_lines(tables.get("survival", []))
    if "survival" in tables:
        return survival_lines(tables["survival"])
    if "quantiles" in tables:
        return quantile_lines(tables["quantiles"])
    return _table(config).lines(summary)


def _table(config: RunConfig) -> ResultTable:
    """A table without the many gains of a large plant that the survey leaves alone."""
    survey, controller = config.survey.model_dump(), config.controller.model_dump(exclude={"type"})
    unvaried = [name for name in controller if name not in survey.get("axes", {})]
    hidden = unvaried if len(controller) > MOST_DESIGN_VARIABLES and survey["type"] in ("single", "grid") else []
    return ResultTable(config.objectives, hidden, "result" if survey["type"] in ("single", "lqr_seed") else "optimum")


def _report(failures: Sequence[tuple[_Job, Exception]], options: argparse.Namespace, several: bool) -> int:
    """Write the failures to standard error and return the exit code."""
    codes = [report(error, options.debug, job.label) for job, error in failures]
    return (1 if several else codes[0]) if codes else 0


def _failure(config: RunConfig, error: Exception) -> dict[str, Any]:
    """The JSON of a run that gave no result."""
    found = {"experiment": config.name, "status": "failed", "reused": False, "error": sentence(error)}
    return {key: found.get(key) for key in _KEYS}
