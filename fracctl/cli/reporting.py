"""`fracctl report`: stored runs as one HTML file."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.errors import UsageError

SUMMARY = "write an HTML page on a stored run, or on several side by side"

_DESCRIPTION = """\
Write one HTML file that shows a stored run: what was run in words and units, the result in a sentence, figures, tables,
published numbers beside computed ones, configuration, provenance, and the command that repeats it. The file needs no
other and asks the network for nothing. Of several runs it shows what tells them apart and what they share.

The last line is the file: report.html in the run's directory, or comparison.html here for several runs."""

_EXAMPLES = """\
  fracctl report outputs/ic1_outofplane/0123456789ab
  fracctl report outputs/ic1_outofplane/* --to pages/ic1.html
  fracctl list runs                                            names stored runs"""

COMPARISON = "comparison.html"


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("report", "RUN_DIR …", _DESCRIPTION, _EXAMPLES)
    parser.add_argument("runs", nargs="*", type=Path, metavar="RUN_DIR", help="directory of a run, finished or not")
    parser.add_argument("--to", type=Path, metavar="FILE", help="file to write instead")
    parser.add_argument(
        "--json", action="store_true", help="one JSON object with the file and the runs, and nothing else"
    )
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    paths: list[Path] = options.runs
    _check(paths, options.to)
    from fracctl.report.page import comparison_page, run_page, write
    from fracctl.report.stored import StoredRun

    runs = [StoredRun.read(path) for path in paths]
    if len(runs) == 1:
        target, page = options.to or runs[0].directory.report, run_page(runs[0])
    else:
        target, page = options.to or Path(COMPARISON), comparison_page(runs)
    write(target, page)
    if options.json:
        named = [str(run.directory.path) for run in runs]
        output.say(json.dumps({"report": str(target.absolute()), "runs": named}, ensure_ascii=False))
    else:
        output.say(str(target))
    return 0


def _check(paths: Sequence[Path], to: Path | None) -> None:
    if not paths:
        raise UsageError("'report' needs the directory of a run; 'fracctl list runs' names those below outputs/")
    for place, path in enumerate(paths):
        if "=" in path.name and not path.exists():
            raise UsageError(f"'report' takes directories of runs, not the override '{path}'; 'fracctl run' prints one")
        if path.resolve() in [other.resolve() for other in paths[:place]]:
            raise UsageError(f"'{path}' is named twice; a run is compared with others")
    if to is not None and to.is_dir():
        raise UsageError(f"--to {to} is a directory; name a file in it, as {to / 'report.html'}")
