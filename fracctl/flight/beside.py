"""Laws of which each has one flight a stage: all that is measured beside each other, and their paths."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.evaluation import LAW_NUMBER

LAWS, PATHS = "laws", "paths"
"""Names of the tables."""
SAMPLES = 1001
"""Of a path, uniform from 0 to the horizon."""
Record = dict[str, Any]


def measured(rows: Mapping[str, Array], columns: Sequence[str], stage: str) -> list[Record]:
    """Return a record for each start and law: the columns, and the status, of its flight at a stage."""
    names = ("initial_condition", "law", "stage", *columns, "status")
    values = zip(*(rows[name][rows["stage"] == stage].tolist() for name in names), strict=True)
    return [dict(zip(names, row, strict=True)) for row in values]


def paths(
    rows: Mapping[str, Array],
    stage: str,
    horizon: float,
    sampled: Callable[[Mapping[str, float], str, Floats], Mapping[str, Floats]],
) -> Iterator[Record]:
    """Yield the samples of all flights at a stage, one after the other.

    Args:
        rows: of the run.
        stage: whose flights.
        horizon: of them.
        sampled: columns over times of the flight of a design from a start.
    """
    times = np.linspace(0.0, horizon, SAMPLES)
    for place in np.flatnonzero((rows["stage"] == stage) & np.isin(rows["status"], ("ok", "unsettled"))):
        start = str(rows["initial_condition"][place])
        columns = sampled({LAW_NUMBER: float(rows[LAW_NUMBER][place])}, start, times)
        whose = {"initial_condition": start, "law": rows["law"][place], "stage": stage}
        for time, *values in zip(times.tolist(), *(column.tolist() for column in columns.values()), strict=True):
            yield whose | {"time": time} | dict(zip(columns, values, strict=True))
