"""The best row of a law for a problem, among all rows of it, whatever they were searched for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.comparison.compared import ComparedLaws
from fracctl.comparison.laws import extends
from fracctl.comparison.problems import LAW, PART, Problem
from fracctl.comparison.searches import GRID, ONWARD, SEARCHED

FOUND_BY = (SEARCHED, GRID, ONWARD)
"""Parts of the study whose rows may be the best ones."""

Row = Mapping[str, Any]


class Selection:
    """Rows of all searches.

    A point that was found for a narrow band or a low limit counts for wider and higher ones too, so that the best
    value never falls when a problem becomes harder. One that was found for a law counts for all laws that extend it, as
    the points of PD do for PD^α, of order 1, for PD with a lag, of lag 0, and for PID, so that none of them is worse.

    Args:
        comparison: says what is admissible.
        rows: of the table.
    """

    def __init__(self, comparison: ComparedLaws, rows: Mapping[str, Array]) -> None:
        self._comparison, self._rows = comparison, rows
        candidates = np.isin(rows[PART], FOUND_BY)
        laws = [comparison.law_of(law) for law in comparison.laws]
        self._inner = {law.name: [one.name for one in laws if extends(law, one)] for law in laws}
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

        Its law is the one that it was found for: this one, or one that it extends and that has a better point.
        """
        own = self.own(law, initial_condition, problem, start)
        for inner in self._inner[law]:
            other = self.own(inner, initial_condition, problem, start)
            if other is not None and (own is None or other["objective"] < own["objective"]):
                own = other
        return own

    def own(
        self, law: str, initial_condition: str, problem: Problem, start: int | None = None
    ) -> dict[str, Any] | None:
        """Return the best row that was found for a law itself, as `best` does.

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
        own = np.asarray(self._parts[law, initial_condition]["start"], dtype=np.float64)
        numbers = np.unique(own[np.isfinite(own)])
        values = np.full(numbers.size, np.inf)
        for one in (law, *self._inner[law]):
            rows = self._parts[one, initial_condition]
            found = self._comparison.admissible(rows, problem)
            at = np.where(rows["start"] == numbers[:, None], found, np.inf)
            values = np.minimum(values, at.min(axis=1, initial=np.inf))
        return values
