"""Published numbers beside computed ones: of one run, and of all runs of a paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from fracctl.errors import FracctlError, RunError
from fracctl.report.contents import Picture, pictures
from fracctl.report.stored import StoredRun
from fracctl.report.tables import Cell, Column, Table, cell
from fracctl.reproduction.published import UNITS, WORDS
from fracctl.reproduction.recipes import Recipe, RunOptima
from fracctl.reproduction.section import EXACT, SAMPLED, Reproduction, Row
from fracctl.reproduction.suites import Section, Suite, read_suite, suite_names
from fracctl.reproduction.table import cells, conclusion
from fracctl.reproduction.verdicts import judge
from fracctl.store import RunDirectory

_HEADINGS = ("quantity", "place", "published", "unit", "computed", "exact", "difference", "verdict", "reason")
_NUMBERS = ("published", "computed", "exact", "difference")
_ONE_RUN = tuple(heading for heading in _HEADINGS if heading != "exact")


def of_run(run: StoredRun) -> tuple[list[Table], list[str]]:
    """Return the numbers that papers print of a run's experiment beside those of its optima, and what is in the way."""
    if not run.directory.optima_path.exists():
        return [], []
    try:
        return [table for suite in _suites() for name in suite.sections for table in _of_section(run, suite, name)], []
    except RunError as problem:
        return [], [str(problem)]


def _suites() -> Iterator[Suite]:
    for name in suite_names():
        try:
            yield read_suite(name)
        except FracctlError:
            continue


def _of_section(run: StoredRun, suite: Suite, name: str) -> Iterator[Table]:
    section = suite.sections[name]
    if run.name not in section.experiments:
        return
    own = [(row, recipe) for row, recipe in suite.rows(name) if _experiments(section, recipe) == {run.name}]
    optima = RunOptima(section.points, {run.name: run.directory.optima()}, section.experiment)
    rows = []
    for row, recipe in own:
        number = optima.number(recipe)
        computed = None if number is None else number / UNITS[row.unit]
        verdict = judge(row, computed)
        shown = cells(Row(row, computed, None, verdict.difference, verdict.word))
        rows.append(_row([row.quantity, row.place, *shown[1:4], *shown[5:]], _ONE_RUN))
    if rows:
        remark = (
            "Computed as this run is configured; the paper's numbers come from its own sampling, which "
            f"'fracctl reproduce {suite.name}/{name}' uses."
        )
        yield Table(f"{suite.paper}: {section.title}", _columns(_ONE_RUN), rows, remark)


def _experiments(section: Section, recipe: Recipe) -> set[str]:
    return {section.points[point].experiment or section.experiment for point in recipe.points}


def _columns(headings: Sequence[str]) -> list[Column]:
    return [Column(heading, is_name=False, right=heading in _NUMBERS) for heading in headings]


def _row(texts: Sequence[str], headings: Sequence[str]) -> list[Cell]:
    return [_cell(text, heading) for text, heading in zip(texts, headings, strict=True)]


def _cell(text: str, heading: str) -> Cell:
    if heading == "verdict":
        return Cell(text.replace("_", " "), mark=text)
    if heading in _NUMBERS:
        try:
            return Cell(text, float(text.lstrip("<> ")))
        except ValueError:
            return Cell(text.strip("-") or "–")
    return cell(text)


class PaperSection:
    """A section of a paper for a page.

    Args:
        result: of its runs.
    """

    def __init__(self, result: Reproduction) -> None:
        self.name, self.title = result.name, result.title
        self.conclusion = conclusion(result) + "."
        self.counts: Mapping[str, int] = result.counts
        self.broken = [row.published.quantity for row in result.failures]
        rows = []
        for row in result.rows:
            _, *shown = cells(row)
            rows.append(_row([row.published.quantity, row.published.place, *shown], _HEADINGS))
        remark = (
            "computed: with the paper's sampling; exact: with exact measures. Numbers have one digit more than printed."
        )
        self.table = Table(f"{result.title}: published and computed", _columns(_HEADINGS), rows, remark)
        self._runs = result.runs
        self.runs: list[tuple[str, Path]] = [
            (f"{name}, {sampling}", run.run_directory)
            for sampling in (SAMPLED, EXACT)
            for name, run in result.runs[sampling].items()
        ]

    def pictures(self, prefix: str) -> list[Picture]:
        """Return the figures of the runs with exact measures."""
        found: list[Picture] = []
        for place, run in enumerate(self._runs[EXACT].values()):
            found += pictures(StoredRun(RunDirectory(run.run_directory)), f"{prefix}r{place}")[0]
        return found


def total(sections: Sequence[PaperSection]) -> dict[str, int]:
    """Return the number of rows by verdict over all sections."""
    return {word: sum(section.counts[word] for section in sections) for word in WORDS}
