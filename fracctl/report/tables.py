"""Tables of a report: columns with units, cells with what they are sorted by."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from fracctl.report.numbers import count, number
from fracctl.store.columns import DIMENSIONLESS, unit

MOST_ROWS = 100
"""Longer tables are cut."""
_DIGITS = 6
_TIMES = ("_orbits", "_periods", "_min")
"""Endings of columns in which infinite is never."""


@dataclass(frozen=True)
class Cell:
    """What stands in a table."""

    text: str
    key: float | None = None
    """What a number is sorted by; None for words."""
    mark: str = ""
    """Class of a verdict."""

    @property
    def sorted_by(self) -> str:
        """The key as a script reads it, where it is not the text itself."""
        if self.key is None:
            return ""
        if math.isinf(self.key):
            return "Infinity" if self.key > 0.0 else "-Infinity"
        try:
            float(self.text)
        except ValueError:
            return repr(self.key)
        return ""


@dataclass(frozen=True)
class Column:
    """Heading of a column."""

    name: str
    unit: str = ""
    is_name: bool = True
    """Whether it is the name of a column of a stored table."""
    right: bool = False
    """Whether its cells end at one line, as numbers do."""


@dataclass(frozen=True)
class Table:
    """A table with its caption."""

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    remark: str = ""
    """Where the whole of a table is that is cut."""


def unit_of(column: str) -> str:
    """Return the unit of a stored column, empty of a dimensionless one."""
    word = unit(column)
    return "" if word == DIMENSIONLESS else word


def cell(value: Any, column: str = "") -> Cell:
    """Return a value as a cell; words of its column decide what infinite is called."""
    if value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value)):
        return Cell("–")
    if isinstance(value, bool):
        return Cell("yes" if value else "no")
    if not isinstance(value, numbers.Real):
        return Cell(str(value))
    if math.isinf(value):
        return Cell("never" if column.startswith("settling") or column.endswith(_TIMES) else "∞", float(value))
    return Cell(number(int(value) if isinstance(value, numbers.Integral) else float(value), _DIGITS), float(value))


def of_frame(caption: str, frame: pd.DataFrame, whole: str, best_by: str = "", of: int | None = None) -> Table:
    """Return a stored table, without columns that are empty, cut where it is long.

    Args:
        caption: what it shows.
        frame: rows in the order in which they are shown.
        whole: file that holds all of it.
        best_by: objective by which they are ordered; empty where they are in no order.
        of: number of rows of the stored table, where `frame` holds the first of them only.
    """
    filled = frame.dropna(axis="columns", how="all")
    names = [str(name) for name in filled.columns]
    rows = [
        [cell(value, name) for name, value in zip(names, row, strict=True)]
        for row in filled.head(MOST_ROWS).itertuples(index=False)
    ]
    return _table(caption, names, rows, _cut(rows, of or len(frame), whole, best_by))


def of_records(caption: str, records: Sequence[Mapping[str, Any]], whole: str) -> Table:
    """Return rows given one by one as a table; of JSON, where times that do not come are none."""
    known = dict.fromkeys(name for record in records for name in record)
    names = [name for name in known if any(record.get(name) is not None for record in records)]
    rows = [[_json_cell(record, name) for name in names] for record in records[:MOST_ROWS]]
    return _table(caption, names, rows, _cut(rows, len(records), whole))


def _table(caption: str, names: Sequence[str], rows: Sequence[Sequence[Cell]], remark: str) -> Table:
    numeric = [any(row[place].key is not None for row in rows) for place in range(len(names))]
    columns = [Column(name, unit_of(name), right=right) for name, right in zip(names, numeric, strict=True)]
    return Table(caption, columns, rows, remark)


def _cut(rows: Sequence[Any], of: int, whole: str, best_by: str = "") -> str:
    if len(rows) == of:
        return ""
    which = (
        f"the best {len(rows)} of {count(of, 'row')} by {best_by}" if best_by else f"the first {len(rows)} of {of} rows"
    )
    return f"These are {which}; all are in {whole}."


def upright(
    caption: str, names: Iterable[str], points: Sequence[tuple[str, Mapping[str, Any]]], remark: str = ""
) -> Table:
    """Return a row for each quantity and a column for each point; rows without any value are left out.

    Args:
        caption: what it shows.
        names: columns of stored tables, or ``what, unit``.
        points: title and values by name.
        remark: below the table.
    """
    columns = [Column("quantity", is_name=False), Column("unit", is_name=False)]
    columns += [Column(title, is_name=False, right=True) for title, _ in points]
    rows = []
    for name in names:
        cells = [_json_cell(point, name) for _, point in points]
        if any(point.get(name) is not None for _, point in points):
            what, _, given = name.partition(", ")
            rows.append([Cell(what), Cell(given or unit_of(name)), *cells])
    return Table(caption, columns, rows, remark)


def _json_cell(record: Mapping[str, Any], column: str) -> Cell:
    """A value of JSON, where times that do not come are none; what is not measured is no time."""
    value = record.get(column)
    if value is None and column in record and (column.startswith("settling") or column.endswith("_orbits")):
        return Cell("never", math.inf)
    return cell(value, column)
