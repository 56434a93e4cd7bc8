"""Laws of which each has one flight at the last stage: all that is measured beside each other, and their paths."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.evaluation import LAW_NUMBER

LAWS, PATHS = "laws", "paths"
"""Names of the tables."""
Record = dict[str, Any]


def records(rows: Mapping[str, Array], columns: Sequence[str], stage: str) -> list[Record]:
    """Return a record for each start and law: the columns, and the status, of its flight at a stage."""
    names = ("initial_condition", "law", "stage", *columns, "status")
    values = zip(*(rows[name][rows["stage"] == stage].tolist() for name in names), strict=True)
    return [dict(zip(names, row, strict=True)) for row in values]


def paths(
    rows: Mapping[str, Array],
    stage: str,
    sampled: Callable[[Mapping[str, float], str], Mapping[str, Floats]],
) -> Iterator[Record]:
    """Yield the samples of all flights at a stage, one after the other.

    Args:
        rows: of the run.
        stage: whose flights.
        sampled: columns of the flight of a design from a start, the time first.
    """
    for place in np.flatnonzero((rows["stage"] == stage) & np.isin(rows["status"], ("ok", "unsettled"))):
        start = str(rows["initial_condition"][place])
        columns = sampled({LAW_NUMBER: float(rows[LAW_NUMBER][place])}, start)
        whose = {"initial_condition": start, "law": rows["law"][place], "stage": stage}
        for values in zip(*(column.tolist() for column in columns.values()), strict=True):
            yield whose | dict(zip(columns, values, strict=True))
