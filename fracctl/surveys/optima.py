"""The optima of a survey: the best point of every slice, of all, and of the baseline."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Booleans
from fracctl.surveys.base import SEARCHED_FOR, Rows

KINDS = ("overall", "baseline", "slice")

Rank = tuple[float, ...]
"""What is smaller for a better row: objective, control effort, design variables."""
_Place = tuple[str, str, str, tuple[float, ...]]


def candidates(rows: Rows, objective: str, factors: Sequence[str]) -> Booleans:
    """Return which rows may be an optimum of the objective that is the geometric mean of `factors`, (n,).

    A candidate has status ``ok``, is not known to be unstable, and has a finite objective. A combined objective needs
    a control effort other than 0. The rows of a search count for the objective that was searched for.
    """
    unstable = np.equal(np.asarray(rows["stable"], dtype=object), False)
    allowed: Booleans = (rows["status"] == "ok") & ~unstable & np.isfinite(rows[f"objective_{objective}"])
    if len(factors) > 1 and "control_effort" in rows:
        allowed &= rows["control_effort"] != 0.0
    if SEARCHED_FOR in rows:
        allowed &= np.isin(rows[SEARCHED_FOR], np.array([objective, None], dtype=object))
    return allowed


def ranks(rows: Rows, objective: str, factors: Sequence[str], design_variables: Sequence[str]) -> list[Rank]:
    """Return the rank of every row; the objective is infinite in that of a row that is no candidate.

    Ties go to the smallest control effort, then to the lexicographically smallest design variables.
    """
    values = np.where(candidates(rows, objective, factors), rows[f"objective_{objective}"], np.inf)
    effort = np.asarray(rows.get("control_effort", np.zeros(len(values))))
    columns = [values, np.where(np.isnan(effort), np.inf, effort), *(rows[name] for name in design_variables)]
    return list(zip(*(column.tolist() for column in columns), strict=True))


class Optima:
    """Selects optima from rows that come part by part, by `candidates` and `ranks`; holds the best rows only.

    Args:
        objectives: measure columns by name of the objective; its values are the column ``objective_<name>``.
        design_variables: their columns, in the order of the tables.
        slices: the design variables for each combination of whose values an optimum is selected.
        baseline: values of design variables that the points of kind ``baseline`` have.
        any_single: whether a baseline or a slice that is one point only counts even if it is no candidate: free motion
            that does not stay bounded is what control is compared with, and a law that fails is one of those compared.
    """

    def __init__(
        self,
        objectives: Mapping[str, Sequence[str]],
        design_variables: Sequence[str],
        slices: Sequence[str] = (),
        baseline: Mapping[str, float] | None = None,
        any_single: bool = False,
    ) -> None:
        self._any_single = any_single
        self._objectives = objectives
        self._design_variables = tuple(design_variables)
        self._slices = tuple(slices)
        self._baseline = dict(baseline or {})
        self._initial_conditions: list[str] = []
        self._best: dict[_Place, tuple[Rank, dict[str, Any]]] = {}
        self._only: dict[_Place, dict[str, Any] | None] = {}

    def add(self, rows: Rows) -> None:
        """Take further rows into account."""
        names = rows["initial_condition"]
        present = list(dict.fromkeys(names.tolist()))
        self._initial_conditions += [name for name in present if name not in self._initial_conditions]
        for objective, factors in self._objectives.items():
            allowed = candidates(rows, objective, factors)
            for name in present:
                self._add(rows, objective, name, names == name, allowed & (names == name))

    def rows(self) -> list[dict[str, Any]]:
        """Return the optima: `kind`, `slice`, `objective_name`, then the columns of the rows.

        `slice` is the value of the one variable that has slices, None where there are several or none. Sorted by
        objective and initial condition as they were given, then overall, baseline, slices ascending.
        """
        return [
            {"kind": kind, "slice": values[0] if len(values) == 1 else None, "objective_name": objective, **row}
            for objective in self._objectives
            for name in self._initial_conditions
            for kind in KINDS
            for values, row in self._of(objective, name, kind)
        ]

    def _of(self, objective: str, name: str, kind: str) -> Iterator[tuple[tuple[float, ...], dict[str, Any]]]:
        single = {place: row for place, row in self._only.items() if row is not None}
        places = single | {place: row for place, (_, row) in self._best.items()}
        found = [(place[3], row) for place, row in places.items() if place[:3] == (objective, name, kind)]
        yield from sorted(found, key=lambda item: item[0])

    def _add(self, rows: Rows, objective: str, name: str, present: Booleans, allowed: Booleans) -> None:
        self._offer(rows, allowed, (objective, name, "overall", ()))
        if self._baseline:
            matching = np.logical_and.reduce([rows[column] == value for column, value in self._baseline.items()])
            self._offer_also_single(rows, present & matching, allowed, (objective, name, "baseline", ()))
        if self._slices:
            table = np.stack([rows[column] for column in self._slices], axis=-1)
            own = table[present]
            first = np.append(True, (own[1:] != own[:-1]).any(axis=1))  # of rows that follow each other on one slice
            for values in np.unique(own[first], axis=0):
                inside = present & (table == values).all(axis=1)
                self._offer_also_single(rows, inside, allowed, (objective, name, "slice", tuple(values.tolist())))

    def _offer_also_single(self, rows: Rows, inside: Booleans, allowed: Booleans, place: _Place) -> None:
        self._offer(rows, allowed & inside, place)
        (where,) = np.nonzero(inside & (rows["status"] != "failed"))
        if self._any_single and where.size:
            alone = where.size == 1 and place not in self._only
            self._only[place] = _row(rows, where[0]) if alone else None

    def _offer(self, rows: Rows, allowed: Booleans, place: _Place) -> None:
        (where,) = np.nonzero(allowed)
        if not where.size:
            return
        values = rows[f"objective_{place[0]}"][where]
        lowest = where[values == values.min()]
        tied = {column: array[lowest] for column, array in rows.items()}
        found = ranks(tied, place[0], self._objectives[place[0]], self._design_variables)
        rank = min(found)
        if place not in self._best or rank < self._best[place][0]:
            self._best[place] = (rank, _row(tied, found.index(rank)))


def _row(rows: Rows, place: int) -> dict[str, Any]:
    return {column: _scalar(array[place]) for column, array in rows.items()}


def _scalar(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
