"""From the rows of `fracctl reproduce --json` to one page of tables a paper, below `_generated`."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fracctl.reproduction.suites import Suite, read_suite, suites_directory

ROWS = "reproduction.jsonl"
"""What `make docs` writes into the folder: a line of JSON for each section."""
COLUMNS = ("quantity", "published", "computed", "exact", "verdict")


def write_pages(folder: Path) -> list[Path]:
    """Write a page for each paper in `ROWS` and return the pages.

    Raises:
        FileNotFoundError: the rows are not there; `make docs` makes them.
        ValueError: a section could not be computed.
    """
    sections = [json.loads(line) for line in (folder / ROWS).read_text(encoding="utf-8").splitlines()]
    for section in sections:
        if "rows" not in section:
            raise ValueError(f"{section['paper']}/{section['section']}: {section['error']}")
    pages = []
    for paper in dict.fromkeys(section["paper"] for section in sections):
        lines = _page(read_suite(paper), [section for section in sections if section["paper"] == paper])
        pages.append(folder / f"{paper}.md")
        pages[-1].write_text("\n".join(lines) + "\n", encoding="utf-8")
    return pages


def _page(suite: Suite, sections: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the lines of a paper's page: its tables, then its README with what lies behind them."""
    readme = (suites_directory() / suite.name / "README.md").read_text(encoding="utf-8")
    yield from (readme.splitlines()[0], "", f"{suite.paper}: published and computed.", "")
    for section in sections:
        counts = ", ".join(f"{count} {_words(word)}" for word, count in section["counts"].items())
        yield from (f"## {suite.sections[section['section']].title}", "")
        yield from (f"`fracctl reproduce {suite.name}/{section['section']}`: {counts}.", "")
        yield from _table(section["rows"])
    yield from ("## What lies behind", "")
    yield from (
        f"```{{include}} ../../experiments/{suite.name}/README.md",
        ":start-line: 1",
        ":heading-offset: 1",
        "```",
    )


def _table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the lines of a table, and its notes: the reasons, each once."""
    reasons = list(dict.fromkeys(row["reason"] for row in rows if row["reason"]))
    yield from (_line(COLUMNS), _line(["---"] * len(COLUMNS)))
    for row in rows:
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        note = f" ({reasons.index(row['reason']) + 1})" if row["reason"] else ""
        numbers = ("-" if row[name] is None else f"{row[name]:.5g}" for name in ("computed", "exact"))
        quantity = f"{row['quantity']} ({row['place']})"
        yield _line([quantity, f"{row['published']}{unit}", *numbers, f"{_words(row['verdict'])}{note}"])
    yield ""
    yield from (f"{number}. {reason}" for number, reason in enumerate(reasons, 1))
    yield ""


def _words(name: str) -> str:
    return name.replace("_", " ")


def _line(entries: Sequence[str]) -> str:
    return "| " + " | ".join(entry.replace("|", "\\|") for entry in entries) + " |"
