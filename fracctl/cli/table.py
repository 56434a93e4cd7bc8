"""Plain tables: columns of text, never wrapped, the same on a terminal and in a file."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

TURN = 2.0 * math.pi

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
            lines += table([row for result in of_name for row in self._rows(result, name, result is of_name[0])])
        return lines

    def _rows(self, result: Mapping[str, Any], name: str | None, first: bool) -> Iterator[list[str]]:
        optimum, baseline, change = result["optimum"], result["baseline"], result["change_percent"]
        condition = str(result.get("initial_condition") or (optimum or {}).get("initial_condition") or "")
        if optimum is None:
            yield [condition, f"no {self.best}"]
            return
        columns = [column for column in _columns(optimum) if column not in self.hidden]
        columns += [f"objective_{name}"] if len(self.objectives.get(str(name), ())) > 1 else []
        if first:
            yield ["", "", *[heading for column in columns for heading in _heading(column, name)]]
        for label, values in ((self.best, optimum), ("baseline", baseline)):
            if values is not None:
                shown = [cell for column in columns for cell in _cells(column, values.get(column))]
                yield [condition if values is optimum else "", label, *shown]
        if change is not None:
            yield ["", "change", f"{change:+.1f} %"]


def number(value: Any, digits: int = 6) -> str:
    """A number for reading; anything else as text."""
    if value is None:
        return "-"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return f"{value:.{digits}g}"


def count(how_many: int, what: str) -> str:
    """``1 point``, ``2 points``."""
    return f"{how_many} {what}" + ("" if how_many == 1 else "s")


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
