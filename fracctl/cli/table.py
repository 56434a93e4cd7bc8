"""Plain tables: columns of text, never wrapped, the same on a terminal and in a file."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fracctl.report.numbers import number

TURN = 2.0 * math.pi

MOST_COLUMNS = 9
"""With more columns than this a result is written from top to bottom."""

_BAND_IN_UNITS = re.compile(r"settling_time_.*_m_(min|orbits)")
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
            columns = self._columns(of_name, name)
            lines.append(title(name, self.objectives.get(str(name), ())))
            lines += table((self._upright if len(columns) > MOST_COLUMNS else self._flat)(of_name, name, columns))
        return lines

    def _flat(self, results: Sequence[Mapping[str, Any]], name: str | None, columns: Sequence[str]) -> list[list[str]]:
        """A row for each point."""
        rows = [["", "", *_headings(columns, name)]] if columns else []
        for result in results:
            rows += self._points(result, columns)
            if _has_changed(result):
                rows.append(["", "change", _percent(result)])
        return rows

    def _upright(
        self, results: Sequence[Mapping[str, Any]], name: str | None, columns: Sequence[str]
    ) -> list[list[str]]:
        """A column for each point."""
        written = [["", "", *_headings(columns, name), "change"]]
        for result in results:
            change = _percent(result) if _has_changed(result) else ""
            written += [[*point, end] for point, end in zip(self._points(result, columns), (change, ""), strict=False)]
        rows = itertools.zip_longest(*written, fillvalue="")
        return [list(row) for row in rows if any(row[1:])]

    def _columns(self, results: Sequence[Mapping[str, Any]], name: str | None) -> list[str]:
        """What is shown of each point; its status where one is not ok."""
        points = [point for result in results for point in (result["optimum"], result["baseline"]) if point is not None]
        if not points:
            return []
        columns = [column for column in _columns(points[0]) if column not in self.hidden]
        columns += [f"objective_{name}"] if len(self.objectives.get(str(name), ())) > 1 else []
        return columns + ([] if all(point.get("status", "ok") == "ok" for point in points) else ["status"])

    def _points(self, result: Mapping[str, Any], columns: Sequence[str]) -> list[list[str]]:
        """Optimum and baseline: initial condition, what it is, and the columns' values."""
        optimum, baseline = result["optimum"], result["baseline"]
        condition = str(result.get("initial_condition") or (optimum or {}).get("initial_condition") or "")
        if baseline is not None and baseline == optimum:
            return [[condition, f"{self.best} = baseline", *_values(columns, baseline)]]
        if optimum is None:
            only = f"no {self.best}" if baseline is None else f"baseline (no {self.best})"
            return [[condition, only, *([] if baseline is None else _values(columns, baseline))]]
        rest = [] if baseline is None else [["", "baseline", *_values(columns, baseline)]]
        return [[condition, self.best, *_values(columns, optimum)], *rest]


def _has_changed(result: Mapping[str, Any]) -> bool:
    return result["change_percent"] is not None and result["optimum"] != result["baseline"]


def _values(columns: Sequence[str], row: Mapping[str, Any]) -> list[str]:
    return [cell for column in columns for cell in (_band(column, row) or _cells(column, row.get(column)))]


def _band(column: str, row: Mapping[str, Any]) -> list[str]:
    """The settling time to a band in both units, which have columns of their own."""
    orbits, minutes = row.get(f"{column}_orbits"), row.get(f"{column}_min")
    return [f"{number(orbits, 4)} orbits, {number(minutes, 4)} min"] if orbits and minutes else []


def _headings(columns: Sequence[str], name: str | None) -> list[str]:
    return [heading for column in columns for heading in _heading(column, name)]


def _percent(result: Mapping[str, Any]) -> str:
    return f"{result['change_percent']:+.1f} %"


def title(name: str | None, factors: Sequence[str]) -> str:
    """Return the name of an objective, with what it is the geometric mean of."""
    if name is None or len(factors) < 2:
        return str(name or "result")
    return f"{name} = ({' · '.join(factors)})^(1/{len(factors)})"


def _columns(row: Mapping[str, Any]) -> list[str]:
    """Design variables and measures: the columns before the objective's."""
    names = list(row)
    end = names.index(_AFTER_THE_MEASURES) if _AFTER_THE_MEASURES in names else len(names)
    return [name for name in names[:end] if name != "initial_condition" and not _BAND_IN_UNITS.fullmatch(name)]


def _heading(column: str, name: str | None) -> list[str]:
    if column == "settling_time":
        return [column, ""]
    return [str(name)] if column == f"objective_{name}" else [column]


def _cells(column: str, value: Any) -> list[str]:
    """The settling time stands in units of T = 2π too."""
    if column != "settling_time":
        return [number(value)]
    return [number(value), "" if value is None else f"{value / TURN:.4f} T"]
