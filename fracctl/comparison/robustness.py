"""How much worse the best points of a law become where its gains, orders and lags are not quite met."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.comparison.compared import ComparedLaws
from fracctl.comparison.descent import descend, neighbours
from fracctl.comparison.laws import LawEvaluation
from fracctl.comparison.problems import PART, Problem
from fracctl.comparison.searches import START
from fracctl.controllers.parameters import Parameter
from fracctl.evaluation import Evaluation
from fracctl.surveys.base import EVALUATIONS_SPENT, POINT, SEARCHED_FOR

AXES, INTERIOR, WORST, HORIZON = "axes", "interior", "worst", "horizon"
"""Parts of the study: the worst of the points on the axes, of those inside, of all that a search finds; and the
point itself over another horizon."""
HALF_WIDTHS: Mapping[str, float] = {"gain": 0.05, "order": 0.01, "time": 0.01}
"""Of the box around a best point, by the kind of parameter."""
_SIMPLE: Mapping[str, float] = {"gain": 0.0, "order": 1.0}
_ROUNDS = 12
"""Of the search for the worst point."""


@dataclass(frozen=True)
class Robustness:
    """Looks for the worst objective in the box around points of a law, one problem each.

    The points are the ends of the n axes of the box, `interior` uniform ones, and those of a pattern search for the
    worst that goes out from the worst of them. What leaves the band open or the loop unstable is infinitely bad.
    """

    law: str
    initial_condition: str
    problems: tuple[Problem, ...]
    """Of each point."""
    interior: int
    seed: tuple[int, ...]

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the points, over the horizons of the report too, then the worst of each part."""
        assert isinstance(evaluation, ComparedLaws)
        law = evaluation.law_of(self.law)
        alone = {self.initial_condition: evaluation.initial_conditions[self.initial_condition]}
        plain = replace(law.by_gains, initial_conditions=alone)
        names = plain.design_variables
        points = np.stack([starts[name] for name in names], axis=1)
        lower, upper = boxes([law.parameters[name] for name in names], points)
        random = np.random.default_rng(list(self.seed))
        ends = _axes(points, lower, upper)
        inside = lower[:, None] + random.random((len(points), self.interior, len(names))) * (upper - lower)[:, None]
        table = _Table(evaluation, self, plain)
        table.add(START, points, 1)
        for periods in evaluation.report_periods:
            table.add(HORIZON, points, 1, periods)
        worst, values = self._worst(plain, ends)
        table.add(AXES, worst, ends.shape[1])
        inner, inner_values = self._worst(plain, inside)
        table.add(INTERIOR, inner, self.interior)
        begin = np.where((inner_values < values)[:, None], inner, worst)
        reached = descend(
            lambda around: -self._badness(plain, around),
            begin,
            np.minimum(values, inner_values),
            (lower, upper),
            _ROUNDS * neighbours(len(names)),
            (*self.seed, 1),
            first_step=0.5,
        )
        table.add(WORST, reached.points, ends.shape[1] + self.interior + reached.evaluations)
        return table.rows()

    def _worst(self, plain: LawEvaluation, points: Floats) -> tuple[Floats, Floats]:
        """Return the worst of points (p, c, n), (p, n), and minus how bad they are, (p,)."""
        badness = self._badness(plain, points)
        place = np.argmax(badness, axis=1)
        everyone = np.arange(len(points))
        return points[everyone, place], -badness[everyone, place]

    def _badness(self, plain: LawEvaluation, points: Floats) -> Floats:
        """Return the objective of points (p, c, n), (p, c): infinite if unsettled, -infinite if it was not computed."""
        count, each, n = points.shape
        rows = plain(dict(zip(plain.design_variables, np.ascontiguousarray(points.reshape(-1, n).T), strict=True)))
        values = np.empty((count, each))
        for place, problem in enumerate(self.problems):
            part = slice(place * each, (place + 1) * each)
            values[place] = rows[f"objective_{problem.objective}"][part]
            values[place, rows["status"][part] == "failed"] = -np.inf
        return values


class _Table:
    """Rows of one law, part by part."""

    def __init__(self, comparison: ComparedLaws, study: Robustness, plain: LawEvaluation) -> None:
        self._comparison, self._study, self._plain = comparison, study, plain
        self._parts: list[dict[str, Array]] = []

    def add(self, part: str, points: Floats, spent: int, periods: float | None = None) -> None:
        """Add one point (p, n) of each problem."""
        study, plain = self._study, self._plain
        own = plain if periods is None else replace(plain, horizon=2.0 * np.pi * periods)
        rows = own(dict(zip(own.design_variables, np.ascontiguousarray(points.T), strict=True)))
        keys = {PART: part} | ({} if periods is None else {"horizon_periods": periods})
        table = self._comparison.table_rows(rows, study.law, study.problems, **keys)
        count = len(points)
        self._parts.append(table | {EVALUATIONS_SPENT: np.full(count, spent), POINT: np.arange(count)})

    def rows(self) -> dict[str, Array]:
        """Return all of them."""
        rows = joined(self._parts)
        return rows | {SEARCHED_FOR: np.full(len(rows[POINT]), None, dtype=object)}


def boxes(parameters: Sequence[Parameter], points: Floats) -> tuple[Floats, Floats]:
    """Return lower and upper ends of the boxes around points (p, n), within the ranges of the parameters.

    A gain that is 0 is not built, and a derivative of order 1 is an ordinary one: neither is off.
    """
    simple = points == np.array([_SIMPLE.get(p.kind, np.nan) for p in parameters])
    half = np.where(simple, 0.0, [HALF_WIDTHS[p.kind] for p in parameters])
    least = np.array([p.lower for p in parameters])
    open_ended = np.array([not p.lower_allowed for p in parameters])
    floor = np.where(open_ended, 0.5 * (least + points), least)
    return np.maximum(points - half, floor), np.minimum(points + half, [p.upper for p in parameters])


def _axes(points: Floats, lower: Floats, upper: Floats) -> Floats:
    """Return the ends of the axes of each box, (p, 2n, n)."""
    n = points.shape[1]
    ends = np.repeat(points[:, None], 2 * n, axis=1)
    axis = np.arange(n)
    ends[:, axis, axis], ends[:, n + axis, axis] = lower, upper
    return ends
