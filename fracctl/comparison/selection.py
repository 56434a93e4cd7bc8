"""The best row of a law for a problem, among all rows of it, whatever they were searched for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.comparison.evaluation import LAW, PART, ComparisonEvaluation
from fracctl.comparison.problems import Problem
from fracctl.comparison.searches import GRID, POLISHED, SEARCHED

FOUND_BY = (SEARCHED, GRID, POLISHED)
"""Parts of the study whose rows may be the best ones."""

Row = Mapping[str, Any]


class Selection:
    """Rows of all searches.

    A point that was found for a narrow band or a low limit counts for wider and higher ones too, so that the best
    value never falls when a problem becomes harder.

    Args:
        comparison: says what is admissible.
        rows: of the table.
    """

    def __init__(self, comparison: ComparisonEvaluation, rows: Mapping[str, Array]) -> None:
        self._comparison, self._rows = comparison, rows
        candidates = np.isin(rows[PART], FOUND_BY)
        self._places = {
            (law, condition): np.flatnonzero(candidates & (rows[LAW] == law) & (rows["initial_condition"] == condition))
            for law in comparison.laws
            for condition in comparison.initial_conditions
        }
        self._parts = {
            key: {name: values[places] for name, values in rows.items()} for key, places in self._places.items()
        }

    def best(
        self, law: str, initial_condition: str, problem: Problem, start: int | None = None
    ) -> dict[str, Any] | None:
        """Return the best row, of one start or of all, None if no point is admissible.

        Ties go to the smallest control effort, then to the first row.
        """
        rows = self._parts[law, initial_condition]
        values = self._comparison.admissible(rows, problem)
        if start is not None:
            values = np.where(rows["start"] == start, values, np.inf)
        if not np.isfinite(values).any():
            return None
        (tied,) = np.nonzero(values == values.min())
        place = tied[np.argmin(rows["control_effort"][tied])]
        row = {
            name: column[place].item() if isinstance(column[place], np.generic) else column[place]
            for name, column in rows.items()
        }
        return row | {"objective": float(values[place])}

    def of_starts(self, law: str, initial_condition: str, problem: Problem) -> Floats:
        """Return the best value of each start, (s,), in their order; infinite where it found nothing admissible."""
        rows = self._parts[law, initial_condition]
        start = np.asarray(rows["start"], dtype=np.float64)
        values = self._comparison.admissible(rows, problem)
        return np.array([values[start == number].min() for number in np.unique(start[np.isfinite(start)])])
