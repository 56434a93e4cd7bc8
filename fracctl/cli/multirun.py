"""The summary of `fracctl run -m` on the terminal: one table over all runs, best first."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fracctl.cli.table import TURN, table, title
from fracctl.report.numbers import count, number

MOST_ROWS = 50
"""More rows of one objective stand in the file only."""

_RESULT = "objective"
_SETTLING = "settling_time"


def summary_lines(rows: Sequence[Mapping[str, Any]], varied: Sequence[str], runs: int) -> list[str]:
    """Return the table, one for each objective, and notes on what cannot be compared.

    Args:
        rows: of the summary, in their order.
        varied: keys that the sweep sets.
        runs: how many there are.
    """
    from fracctl.execution.multirun import group_of

    lines = [f"summary of {count(runs, 'run')}, best first"]
    groups = list(dict.fromkeys(group_of(row) for row in rows))
    for group in groups:
        of_group = [row for row in rows if group_of(row) == group]
        lines.append(title(of_group[0]["objective_name"], str(of_group[0]["factors"]).split(" · ")))
        lines += table(_table(of_group[:MOST_ROWS], varied))
        if len(of_group) > MOST_ROWS:
            lines.append(f"  … {len(of_group) - MOST_ROWS} more rows in the file")
        if _several_scales(of_group):
            lines.append("note: 1 stands for other lengths and times in some of these runs; the file holds the scales")
    if len(groups) > 1:
        lines.append("note: runs with different objectives are not ranked with each other")
    return lines


def _table(rows: Sequence[Mapping[str, Any]], varied: Sequence[str]) -> list[list[str]]:
    keys = [key for key in varied if key != _RESULT]
    if len({row["initial_condition"] for row in rows}) > 1 and "initial_condition" not in keys:
        keys.append("initial_condition")
    name = str(rows[0]["objective_name"])
    unit = "" if rows[0]["unit"] == "1" else f" ({rows[0]['unit']})"
    others = [key for key in dict.fromkeys(key for row in rows for key in row) if key.startswith(f"{_RESULT}_")]
    others = [key for key in others if key not in (f"{_RESULT}_{name}", "objective_name")]
    in_turns = rows[0]["factors"] == _SETTLING
    turns = [""] if in_turns else []
    heading = [*keys, name + unit, *turns, *(key.removeprefix(f"{_RESULT}_") for key in others), "status", "directory"]
    return [heading, *([*_cells(row, keys, others, in_turns)] for row in rows)]


def _cells(row: Mapping[str, Any], keys: Sequence[str], others: Sequence[str], in_turns: bool) -> list[str]:
    value = row[_RESULT]
    turns = ["" if value is None else f"{value / TURN:.4f} T"] if in_turns else []
    numbers = [number(row.get(key)) for key in others]
    return [
        *(number(row.get(key)) for key in keys),
        number(value),
        *turns,
        *numbers,
        str(row["status"]),
        _near(row["run_directory"]),
    ]


def _near(directory: str | None) -> str:
    """A path as one types it from here."""
    if directory is None:
        return "-"
    path = Path(directory)
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else os.fspath(path)


def _several_scales(rows: Sequence[Mapping[str, Any]]) -> bool:
    return rows[0]["unit"] == "1" and len({(row["length_scale_m"], row["time_scale_s"]) for row in rows}) > 1
