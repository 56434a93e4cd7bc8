"""The table published | computed | exact | difference | verdict, in words and as files."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import pyarrow as pa

from fracctl.reproduction.published import PublishedRow
from fracctl.reproduction.section import SAMPLINGS, Reproduction, Row
from fracctl.reproduction.verdicts import shown
from fracctl.store import tables
from fracctl.store.files import make_directory, write_bytes

HEADINGS = ("id", "published", "unit", "computed", "exact", "difference", "verdict", "reason")
_NUMBERS = ("tolerance", "computed", "exact", "difference")


def cells(row: Row) -> list[str]:
    """Return a row's cells below `HEADINGS`, for reading: numbers have one digit more than the paper prints."""
    printed = row.published.published
    computed, exact = (shown(number, printed) for number in (row.computed, row.exact))
    difference = "" if row.difference is None else f"{row.difference:+}"
    numbers = ["-" if number is None else str(number) for number in (computed, exact)]
    unit = "" if row.published.unit == "1" else row.published.unit
    return [row.published.id, printed.text, unit, *numbers, difference, row.verdict, row.published.reason]


def sentence(row: Row) -> str:
    """Say that a row does not come out as it must."""
    _, printed, unit, computed, exact, *_ = cells(row)
    place = f"{row.published.quantity} ({row.published.place})"
    return f"{row.published.id}: {place} is published as {printed} {unit}".rstrip() + (
        f", computed {computed}, exact {exact}"
    )


def conclusion(result: Reproduction) -> str:
    """Return e.g. ``51 rows: 50 reproduced, 1 not reproduced, 0 not decidable; every row that must hold does``."""
    counts = ", ".join(f"{count} {word.replace('_', ' ')}" for word, count in result.counts.items())
    broken = len(result.failures)
    some = f"{broken} that must hold {'does' if broken == 1 else 'do'} not"
    end = some if broken else "every row that must hold does"
    return f"{len(result.rows)} rows: {counts}; {end}"


def records(result: Reproduction) -> list[dict[str, Any]]:
    """Return the rows with all columns and full precision; a number that does not exist is None."""
    return [_record(row) for row in result.rows]


def _record(row: Row) -> dict[str, Any]:
    source: PublishedRow = row.published
    return {
        "id": source.id,
        "place": source.place,
        "quantity": source.quantity,
        "unit": source.unit,
        "published": source.published.text,
        "tolerance": None if source.tolerance is None else float(source.tolerance),
        "computed": row.computed,
        "exact": row.exact,
        "difference": None if row.difference is None else float(row.difference),
        "verdict": row.verdict,
        "expected": source.expected,
        "reason": source.reason,
    }


def run_directories(result: Reproduction) -> dict[str, dict[str, str]]:
    """Return the run directories by sampling and experiment."""
    return {
        sampling: {name: str(run.run_directory) for name, run in result.runs[sampling].items()}
        for sampling in SAMPLINGS
    }


def write(result: Reproduction) -> Path:
    """Write ``table.csv``, ``table.parquet`` and ``table.md`` into the result's directory, and return it.

    Raises:
        RunError: it cannot be written.
    """
    make_directory(result.directory)
    rows = records(result)
    write_bytes(result.directory / "table.csv", _csv(rows).encode())
    columns = [(name, pa.float64() if name in _NUMBERS else pa.string()) for name in rows[0]]
    schema = pa.schema(columns, metadata={"fracctl.runs": str(run_directories(result))})
    tables.write(result.directory / "table.parquet", schema, [pa.Table.from_pylist(rows, schema=schema)])
    write_bytes(result.directory / "table.md", _markdown(result).encode())
    return result.directory


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _markdown(result: Reproduction) -> str:
    """The table for reading, with quantity and place instead of the id alone, and the runs below it."""
    headings = ["quantity", "place", *HEADINGS]
    lines = [f"# {result.name}: {result.title}", "", conclusion(result) + ".", ""]
    lines += [_line(headings), _line(["---"] * len(headings))]
    lines += [_line([row.published.quantity, row.published.place, *cells(row)]) for row in result.rows]
    lines += ["", "Runs:", ""]
    lines += [
        f"- {sampling}, {name}: `{directory}`"
        for sampling, directories in run_directories(result).items()
        for name, directory in directories.items()
    ]
    return "\n".join(lines) + "\n"


def _line(entries: list[str]) -> str:
    return "| " + " | ".join(entry.replace("|", "\\|") for entry in entries) + " |"
