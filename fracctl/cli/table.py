"""Plain tables: columns of text, never wrapped, the same on a terminal and in a file."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

TURN = 2.0 * math.pi

MOST_COLUMNS = 9
"""With more columns than this a result is written from top to bottom."""

_AFTER_THE_MEASURES = "objective"


def table(rows: Sequence[Sequence[str]], indent: str = "  ") -> list[str]:
    """Return lines with aligned columns; rows may have different lengths."""
    columns = max((len(row) for row in rows), default=0)
    filled = [[*row, *[""] * (columns - len(row))] for row in rows]
    widths = [max(len(row[i]) for row in filled) for i in range(columns)]
    return [
        (indent + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))).rstrip()
        for row in filled
    ]


@dataclass(frozen=True)
class ResultTable:
    """The optimum and the baseline of every objective and initial condition, from a run's summary."""

    objectives: Mapping[str, Sequence[str]]
    """Columns of which each objective is the geometric mean."""
    hidden: Collection[str] = ()
    """Columns that are not shown."""
    best: str = "optimum"
    """What the optimum is called."""

    def lines(self, summary: Mapping[str, Any]) -> list[str]:
        """Return the table, one part for each objective."""
        results = summary.get("optima", [summary])
        lines = []
        for name in dict.fromkeys(result.get("objective_name") for result in results):
            of_name = [result for result in results if result.get("objective_name") == name]
            lines.append(_title(name, self.objectives.get(str(name), ())))
            lines += table(self._upright(of_name, name) if self._is_long(of_name, name) else self._flat(of_name, name))
        return lines

    def _flat(self, results: Sequence[Mapping[str, Any]], name: str | None) -> list[list[str]]:
        """A row for each point."""
        rows: list[list[str]] = []
        for result in results:
            columns = self._columns(result, name)
            if not rows and columns:
                rows.append(["", "", *_headings(columns, name)])
            rows += self._points(result, columns)
            if result["change_percent"] is not None:
                rows.append(["", "change", _percent(result)])
        return rows

    def _upright(self, results: Sequence[Mapping[str, Any]], name: str | None) -> list[tuple[str, ...]]:
        """A column for each point."""
        shown = next(filter(None, (self._columns(result, name) for result in results)))
        columns = [["", "", *_headings(shown, name), "change"]]
        for result in results:
            points = self._points(result, self._columns(result, name))
            change = _percent(result) if result["change_percent"] is not None else ""
            columns += [[*point, end] for point, end in zip(points, (change, ""), strict=False)]
        rows = list(itertools.zip_longest(*columns, fillvalue=""))
        return [row for row in rows if any(row[1:])]

    def _is_long(self, results: Sequence[Mapping[str, Any]], name: str | None) -> bool:
        return any(len(self._columns(result, name)) > MOST_COLUMNS for result in results)

    def _columns(self, result: Mapping[str, Any], name: str | None) -> list[str]:
        if result["optimum"] is None:
            return []
        columns = [column for column in _columns(result["optimum"]) if column not in self.hidden]
        return columns + ([f"objective_{name}"] if len(self.objectives.get(str(name), ())) > 1 else [])

    def _points(self, result: Mapping[str, Any], columns: Sequence[str]) -> list[list[str]]:
        """Optimum and baseline: initial condition, what it is, and the columns' values."""
        optimum, baseline = result["optimum"], result["baseline"]
        condition = str(result.get("initial_condition") or (optimum or {}).get("initial_condition") or "")
        if optimum is None:
            return [[condition, f"no {self.best}"]]
        named = [(condition, self.best, optimum), ("", "baseline", baseline)]
        return [
            [where, label, *(cell for column in columns for cell in _cells(column, values.get(column)))]
            for where, label, values in named
            if values is not None
        ]


def _headings(columns: Sequence[str], name: str | None) -> list[str]:
    return [heading for column in columns for heading in _heading(column, name)]


def _percent(result: Mapping[str, Any]) -> str:
    return f"{result['change_percent']:+.1f} %"


def number(value: Any, digits: int = 6) -> str:
    """A number for reading; anything else as text."""
    if value is None:
        return "-"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return f"{value:.{digits}g}"


def count(how_many: int, what: str, plural: str = "s") -> str:
    """``1 point``, ``2 points``, ``2 searches``."""
    return f"{how_many} {what}" + ("" if how_many == 1 else plural)


def _title(name: str | None, factors: Sequence[str]) -> str:
    if name is None or len(factors) < 2:
        return str(name or "result")
    return f"{name} = ({' · '.join(factors)})^(1/{len(factors)})"


def _columns(row: Mapping[str, Any]) -> list[str]:
    """Design variables and measures: the columns before the objective's."""
    names = list(row)
    end = names.index(_AFTER_THE_MEASURES) if _AFTER_THE_MEASURES in names else len(names)
    return [name for name in names[:end] if name != "initial_condition"]


def _heading(column: str, name: str | None) -> list[str]:
    if column == "settling_time":
        return [column, ""]
    return [str(name)] if column == f"objective_{name}" else [column]


def _cells(column: str, value: Any) -> list[str]:
    """The settling time stands in units of T = 2π too."""
    if column != "settling_time":
        return [number(value)]
    return [number(value), "" if value is None else f"{value / TURN:.4f} T"]
