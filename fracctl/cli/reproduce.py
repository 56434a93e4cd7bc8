"""`fracctl reproduce`: published numbers beside computed ones, with a verdict for each."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from fracctl.cli import output
from fracctl.cli.failure import report, sentence
from fracctl.cli.parser import Parser
from fracctl.cli.table import table
from fracctl.errors import ConfigurationError, RunError, UsageError, suggestion

if TYPE_CHECKING:
    from fracctl.execution.executors import Executors
    from fracctl.reproduction.section import Reproduction
    from fracctl.reproduction.suites import Suite

SUMMARY = "recompute what a paper publishes, and say number by number whether it comes out"

_DESCRIPTION = """\
Recompute the numbers of a paper and compare them with what is printed. Without argument: all there is.

Each section is run twice, with the sampling that the paper's numbers come from, and with exact measures; stored runs
are used again. The table shows what is published, computed and exact, and a verdict: reproduced, not_reproduced or
not_decidable, with the reason. It is stored as CSV, Parquet and Markdown in the directory of the last line. The exit
code is 1 if a number that must come out does not."""

_EXAMPLES = """\
  fracctl reproduce                              all papers
  fracctl reproduce fractional_hcw               all sections of one
  fracctl reproduce fractional_hcw/out_of_plane  one section
  fracctl reproduce --report fractional_hcw      and an HTML page with figures, the last line
  fracctl reproduce --json                       a line of JSON for each section, with all rows"""


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("reproduce", "[PAPER | PAPER/SECTION …]", _DESCRIPTION, _EXAMPLES)
    parser.add_argument("names", nargs="*", metavar="PAPER[/SECTION]", help="a folder of experiments/, or a part of it")
    parser.add_argument("--report", action="store_true", help="an HTML page too for each paper, with figures")
    parser.add_json("one JSON object a line for each section")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error, no notes")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    from fracctl.execution.executors import Executors

    chosen = select(options.names)
    done: list[Reproduction] = []
    with Executors() as executors:
        codes = [_section(suite, section, options, executors, done) for suite, section in chosen]
    if options.report:
        codes += [_report(suite, done, options) for suite in {suite.name: suite for suite, _ in chosen}.values()]
    return max(codes)


def select(names: Sequence[str]) -> list[tuple[Suite, str]]:
    """Return suites and sections by name, each once; all of them without a name.

    Raises:
        UsageError: there is no such paper or section.
        ConfigurationError: a suite is wrong, or there is none.
    """
    from fracctl.reproduction.suites import read_suite, suite_names, suites_directory

    suites = {name: read_suite(name) for name in suite_names()}
    if not suites:
        raise ConfigurationError(f"there is no suite in {suites_directory()}")
    known = {f"{name}/{section}": (suite, section) for name, suite in suites.items() for section in suite.sections}
    chosen: dict[str, tuple[Suite, str]] = {}
    for name in names or suites:
        found = {key: value for key, value in known.items() if name.strip("/") in (key, key.partition("/")[0])}
        if not found:
            raise UsageError(_unknown(name.strip("/"), list(suites), list(known)))
        chosen |= found
    return list(chosen.values())


def _unknown(name: str, papers: list[str], sections: list[str]) -> str:
    paper, _, wanted = name.partition("/")
    own = {section.partition("/")[2]: section for section in sections if section.partition("/")[0] == paper}
    if own:
        near = suggestion(wanted, own).replace("'", f"'{paper}/", 1)
        return f"'{paper}' has no section '{wanted}'{near or _list('sections', own.values())}"
    bare = [section for section in sections if section.partition("/")[2] == name]
    near = f"; did you mean '{bare[0]}'?" if bare else suggestion(name, sections if wanted else papers)
    return f"there is no paper '{paper}'{near or _list('papers', papers)}"


def _list(what: str, names: Iterable[str]) -> str:
    return f"; {what}: {', '.join(names)}"


def _report(suite: Suite, done: Sequence[Reproduction], options: argparse.Namespace) -> int:
    """Write the page on what was reproduced of a paper, and return its exit code."""
    from fracctl.report.page import paper_page, write
    from fracctl.report.published import PaperSection

    results = [result for result in done if result.paper == suite.name]
    if not results:
        return 0
    path = results[0].directory.parent / "report.html"
    try:
        write(path, paper_page(suite.name, suite.paper, [PaperSection(result) for result in results]))
    except Exception as error:  # noqa: BLE001 - the other papers go on
        return report(error, options.debug, f"{suite.name}: ")
    if options.json:
        output.say_json({"paper": suite.name, "report": str(path)})
    else:
        output.say(str(path))
    return 0


def _section(
    suite: Suite, section: str, options: argparse.Namespace, executors: Executors, done: list[Reproduction]
) -> int:
    """Reproduce one section, show it, and return its exit code; `done` takes the result."""
    from fracctl.cli.progress import display
    from fracctl.reproduction.section import reproduce
    from fracctl.reproduction.table import write

    name = f"{suite.name}/{section}"
    try:
        result = reproduce(
            suite,
            section,
            progress=lambda label: display(f"{name} ({label})", options.quiet),
            executors=executors,
        )
        write(result)
        done.append(result)
    except Exception as error:  # noqa: BLE001 - the other sections go on
        if options.json:
            output.say_json({"paper": suite.name, "section": section, "error": sentence(error)})
        return report(error, options.debug, f"{name}: ")
    failure = _failure(result)
    if options.json:
        output.say_json(_plain(result, failure))
    else:
        _show(result, options.quiet)
    return 0 if failure is None else report(failure, options.debug)


def _failure(result: Reproduction) -> RunError | None:
    from fracctl.reproduction.table import sentence as row_sentence

    if not result.failures:
        return None
    lines = [f"{result.name}: not reproduced: {row_sentence(row)}" for row in result.failures]
    return RunError("\n".join(lines))


def _show(result: Reproduction, quiet: bool) -> None:
    from fracctl.reproduction.table import HEADINGS, cells, conclusion

    rows = [list(HEADINGS), *(cells(row) for row in result.rows)]
    output.say(f"{result.name}: {result.title}")
    if sys.stdout is not None and sys.stdout.isatty():
        _show_wrapped(rows)
    else:
        for line in table(rows):
            output.say(line)
    output.say(conclusion(result))
    for row in () if quiet else result.rows:
        if row.surprises:
            output.say(f"note: {row.published.id} comes out, although published.csv expects {row.published.expected}")
    output.say(str(result.directory))


def _show_wrapped(rows: list[list[str]]) -> None:
    """A table in colours for a terminal, with the reasons below it."""
    from rich import box
    from rich.console import Console
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    colours = {"reproduced": "green", "not_reproduced": "red", "not_decidable": "yellow"}
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    for heading in rows[0][:-1]:
        shown.add_column(heading, no_wrap=heading != "id", overflow="fold")
    for row in rows[1:]:
        shown.add_row(*(Text(cell, style=colours.get(cell, "")) for cell in row[:-1]))
    console = Console()
    console.print(shown)
    for name, *_, reason in rows[1:]:
        if reason:
            console.print(Padding(Text.assemble((name, "bold"), f": {reason}"), (0, 0, 0, 2)))
    console.print()


def _plain(result: Reproduction, failure: RunError | None) -> dict[str, Any]:
    from fracctl.reproduction.table import records, run_directories

    return {
        "paper": result.paper,
        "section": result.section,
        "directory": str(result.directory),
        "runs": run_directories(result),
        "counts": result.counts,
        "failed": [row.published.id for row in result.failures],
        "error": None if failure is None else str(failure),
        "rows": records(result),
    }
