"""Reports as HTML files: one file each, with its pictures, its style and its script, that asks for nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from fracctl.errors import RunError
from fracctl.report import comparison, contents, published
from fracctl.report.published import PaperSection
from fracctl.report.sentences import result
from fracctl.report.stored import StoredRun
from fracctl.store.files import make_directory, write_bytes

_TEMPLATES = Path(__file__).parent / "templates"


def run_page(run: StoredRun) -> str:
    """Return the report on one run, finished or not."""
    pictures, undrawn = contents.pictures(run, "f")
    tables, unread = contents.tables(run)
    published_tables, unjudged = published.of_run(run)
    alerts = list(dict.fromkeys([*run.alerts, *unread, *unjudged, *undrawn]))
    return _render(
        "run.html",
        title=run.name,
        run=run,
        alerts=alerts,
        notes=[note for note in run.notes if note not in run.alerts],
        result=result(run),
        words=contents.in_words(run),
        pictures=pictures,
        tables=tables,
        published=published_tables,
        configuration=contents.configuration_text(run),
        provenance=contents.provenance_rows(run),
        command=contents.command(run),
    )


def comparison_page(runs: Sequence[StoredRun]) -> str:
    """Return several runs side by side."""
    labelled = comparison.labelled(runs)
    figures, undrawn = comparison.figures(labelled)
    alerts = [f"{entry.label}: {alert}" for entry in labelled for alert in entry.run.alerts]
    notes = [(entry.label, [note for note in entry.run.notes if note not in entry.run.alerts]) for entry in labelled]
    return _render(
        "comparison.html",
        title=" · ".join(dict.fromkeys(run.name for run in runs)),
        runs=labelled,
        alerts=[*alerts, *(problem for problem in undrawn if problem not in alerts)],
        notes=[(label, own) for label, own in notes if own],
        overview=comparison.overview(labelled),
        differences=comparison.differences(labelled),
        results=comparison.results(labelled),
        figures=figures,
        commands=[(entry.label, contents.command(entry.run)) for entry in labelled],
        provenance=[(entry.label, contents.provenance_rows(entry.run)) for entry in labelled],
    )


def paper_page(name: str, paper: str, sections: Sequence[PaperSection]) -> str:
    """Return the numbers of a paper beside computed ones, with the figures of the runs.

    Args:
        name: of its suite.
        paper: authors and title.
        sections: those that were run.
    """
    return _render(
        "paper.html",
        title=name,
        paper=paper,
        sections=[(section, section.pictures(f"s{place}")) for place, section in enumerate(sections)],
        total=published.total(sections),
        alerts=[
            f"{section.title}: {what} does not come out as it must" for section in sections for what in section.broken
        ],
        command=f"fracctl reproduce --report {' '.join(section.name for section in sections)}",
    )


def write(path: Path, page: str) -> None:
    """Write a page.

    Raises:
        RunError: it cannot be written.
    """
    try:
        make_directory(path.parent)
        write_bytes(path, page.encode())
    except RunError as problem:
        if not isinstance(problem.__cause__, OSError):
            raise
        reason = problem.__cause__.strerror or problem.__cause__
        raise RunError(f"cannot write the report to {path}: {reason}; --to FILE writes it elsewhere") from problem


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _render(template: str, **what: Any) -> str:
    return _environment().get_template(template).render(what)
