"""`fracctl run`: compose, validate, compute, and show what came out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fracctl.cli import output
from fracctl.cli.failure import report, sentence
from fracctl.cli.multirun import summary_lines
from fracctl.cli.parser import Parser
from fracctl.cli.showing import Ended, Job, add_display_options, compute_and_show
from fracctl.errors import ConfigurationError, RunError, UsageError

if TYPE_CHECKING:
    from fracctl.execution.executors import Executors

SUMMARY = "compute an experiment, or a run composed from options; store it and draw its figures"

_DESCRIPTION = """\
Compute a run and store it below outputs/. Without overrides: one out-of-plane PD^α loop from IC1.

The result is a short table, and as the last line the run's directory. A run that is stored already is not computed
again; one that was interrupted continues. With -m, values separated by commas give one run each; all of them are
composed and checked before the first one starts. At the end stands a table of all, best first, and the file that holds
it, outputs/multirun/<id>/summary.parquet; with --json its path stands in every line."""

_EXAMPLES = """\
  fracctl run experiment=ic1_outofplane                           the best gains and order from IC1
  fracctl run my_study                                            the file my_study.yaml, which 'fracctl init' writes
  fracctl run experiment=ic1_outofplane objective=st_os_u         for another objective
  fracctl run controller.alpha_w=0.91 controller.k_p_w=0.85       one design point
  fracctl run survey=out_of_plane survey.axes.alpha_w=0.9:1:0.02  another axis, both ends included
  fracctl run initial_condition=own initial_condition.own.units=si initial_condition.own.w=100
  fracctl run -m experiment=ic1_outofplane,ic2_outofplane --json  two runs, a line of JSON each
  fracctl run experiment=outofplane --cfg job                     print the configuration only"""


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("run", "[STUDY] [OVERRIDE …]", _DESCRIPTION, _EXAMPLES)
    parser.add_overrides()
    parser.add_argument("-m", "--multirun", action="store_true", help="one run for each of the values key=a,b,c")
    parser.add_argument(
        "--cfg",
        choices=["job"],
        metavar="job",
        help="'--cfg job' prints the resolved configuration, with --json as JSON",
    )
    parser.add_config_dir()
    parser.add_argument("--fresh", action="store_true", help="compute again what is stored already")
    add_display_options(parser)
    parser.add_argument("--fail-fast", action="store_true", help="with -m: do not start further runs after a failure")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    if options.fail_fast and not options.multirun:
        raise UsageError("--fail-fast goes with -m, for a single run has none after it")
    jobs = _jobs(options)
    if options.cfg:
        _print_configurations(jobs, options)
        return 0
    from fracctl.execution.executors import Executors

    with Executors() as executors:
        if options.multirun:
            return _sweep(jobs, options, executors)
        problem = _run(jobs[0], options, executors).problem
    return report(problem, options.debug) if problem else 0


def _print_configurations(jobs: Sequence[Job], options: argparse.Namespace) -> None:
    from fracctl.config.compose import to_yaml

    if options.json:
        for job in jobs:
            output.say_json(job.config.model_dump(mode="json"))
    else:
        output.say("---\n".join(to_yaml(job.config) for job in jobs).rstrip())


def _run(job: Job, options: argparse.Namespace, executors: Executors) -> Ended:
    from fracctl.execution.run import execute as execute_run

    return compute_and_show(
        job,
        options,
        lambda progress: execute_run(
            job.config, command=job.command, fresh=options.fresh, progress=progress, executors=executors
        ),
    )


def _sweep(jobs: Sequence[Job], options: argparse.Namespace, executors: Executors) -> int:
    """Compute all runs, write and show their summary, and list the failures."""
    from fracctl.execution.multirun import summary_path

    path = summary_path([job.config for job in jobs])
    ended: list[Ended] = []
    try:
        for job in jobs:
            ended.append(_run(replace(job, further={"multirun_summary": str(path)}), options, executors))
            if ended[-1].problem and options.fail_fast:
                break
    except KeyboardInterrupt:
        with suppress(RunError):
            _write_summary(path, jobs, [*ended, Ended(None, status="interrupted")])
            output.remark(f"summary of the runs so far: {path}")
        raise
    failures = [(job.label, end.problem) for job, end in zip(jobs, ended, strict=False) if end.problem]
    try:
        lines = _write_summary(path, jobs, ended)
    except RunError as problem:
        failures.append(("summary: ", problem))
    else:
        for line in () if options.json else (*lines, str(path)):
            output.say(line)
    for label, failure in failures:
        report(failure, options.debug, label)
    return 1 if failures else 0


def _write_summary(path: Path, jobs: Sequence[Job], ended: Sequence[Ended]) -> list[str]:
    """Write the summary, and return it as lines."""
    from fracctl.execution.multirun import Entry, summary_rows, write_summary

    missing = [Ended(None, status="not started")] * (len(jobs) - len(ended))
    entries = [
        Entry(
            job.config, job.varied, job.scales, end.summary, sentence(end.problem) if end.problem else None, end.status
        )
        for job, end in zip(jobs, [*ended, *missing], strict=True)
    ]
    rows = summary_rows(entries)
    write_summary(path, rows)
    return summary_lines(rows, list(jobs[0].varied), len(jobs))


def _jobs(options: argparse.Namespace) -> list[Job]:
    """Compose and validate every run."""
    from fracctl.config.build import build_checked
    from fracctl.config.command import Command
    from fracctl.config.compose import compose, expand_multirun
    from fracctl.config.messages import InvalidConfiguration

    overrides: list[str] = options.overrides
    if not options.multirun:
        config = compose(overrides, options.config_dir)
        build_checked(config)
        return [Job(config, Command.of(overrides, options.config_dir))]
    jobs: list[Job] = []
    problems: list[tuple[str, str]] = []
    expanded = expand_multirun(overrides, options.config_dir)
    for place, words in enumerate(expanded, start=1):
        varied = [word for word in words if word not in overrides]
        label = f"run {place} of {len(expanded)} ({' '.join(varied)}): " if len(expanded) > 1 else ""
        try:
            config = compose(words, options.config_dir)
            evaluation, _ = build_checked(config)
            pairs = (word.lstrip("+").partition("=") for word in varied)
            command = Command.of(words, options.config_dir)
            jobs.append(Job(config, command, label, {key: value for key, _, value in pairs}, evaluation.plant.scales))
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
