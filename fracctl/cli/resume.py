"""`fracctl resume`: compute what a stored run lacks."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from fracctl.cli import output
from fracctl.cli.failure import report
from fracctl.cli.parser import Parser
from fracctl.cli.showing import Job, add_display_options, compute_and_show
from fracctl.errors import UsageError

SUMMARY = "continue a stored run: what was interrupted, is damaged, or failed"

_DESCRIPTION = """\
Compute what a stored run lacks, as its run.json says; what is stored is verified first. The directory may have been
moved. Keys of the scheduler may be set, as they change no number; all else is as it was when the run was begun. A run
that other sources of fracctl, or other versions of NumPy or SciPy, have begun is refused: its numbers and today's do
not belong into one table."""

_EXAMPLES = """\
  fracctl resume outputs/ic1_outofplane/0123456789ab
  fracctl resume outputs/ic1_outofplane/0123456789ab scheduler.time_limit=600
  fracctl resume outputs/ic1_outofplane/0123456789ab scheduler=serial"""


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("resume", "RUN_DIR [scheduler.KEY=VALUE …]", _DESCRIPTION, _EXAMPLES)
    parser.add_argument("words", nargs="*", metavar="RUN_DIR", help="directory of the run, then keys of the scheduler")
    add_display_options(parser)
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    if not options.words:
        raise UsageError("'resume' needs a run directory; 'fracctl list runs' names those that are stored")
    from fracctl.execution.perform import is_whole, stored
    from fracctl.execution.resuming import continuation
    from fracctl.execution.run import execute as execute_run
    from fracctl.store import RunDirectory

    directory, overrides = RunDirectory(options.words[0]), options.words[1:]
    if is_whole(directory):
        return _say_finished(stored(directory).summary, options)
    config = continuation(directory, overrides)
    ended = compute_and_show(
        Job(config, directory=directory),
        options,
        lambda progress: execute_run(config, directory=directory, progress=progress),
    )
    return report(ended.problem, options.debug) if ended.problem else 0


def _say_finished(summary: Mapping[str, Any], options: argparse.Namespace) -> int:
    if options.json:
        output.say_json(summary)
    else:
        output.say(f"{summary['experiment']} is finished already; nothing was computed")
        output.say(str(summary["run_directory"]))
    return 0
