"""The searches of a comparison, as workers run them: over a grid, from seeds, and onwards from the best of either."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.comparison.compared import ComparedLaws, sound
from fracctl.comparison.laws import Law, LawEvaluation
from fracctl.comparison.populations import adapt, evolve
from fracctl.comparison.problems import PART, Problem
from fracctl.evaluation import Evaluation
from fracctl.measures.final_distance import FinalDistance
from fracctl.surveys.base import EVALUATIONS_SPENT, POINT, SEARCHED_FOR
from fracctl.surveys.search_run import Variable, latin_hypercube, penalties

START, SEARCHED, GRID, ONWARD = "start", "search", "grid", "onward"
"""Parts of the study that rows of searches belong to; a start counts for nothing but its block."""
_DECIMALS = 12
"""Points are rounded, so that the same one may be met again."""


@dataclass(frozen=True)
class Evolution:
    """Differential evolution of a law for all problems of an initial condition, from several starts.

    Each start of each problem has a population of its own. Within a start every problem takes the best of all points
    that any population looks at; starts learn nothing of each other. The first points do not depend on the law, so
    starts of different laws are pairs. Points that are not admissible are told apart as in
    `fracctl.surveys.search_run.SeededSearch`; where a start has found nothing admissible, its row is the point that
    came nearest to it.
    """

    law: str
    initial_condition: str
    problems: tuple[Problem, ...]
    starts: tuple[int, ...]
    """Numbers of the starts."""
    seeds: tuple[tuple[int, ...], ...]
    """Entropy of each problem of the first start, of the second, …"""
    population: int
    """Points of a generation."""
    evaluations: int
    """Of each population: whole generations."""

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:  # noqa: ARG002
        """Return the first points, which follow from the seeds, then the best ones of each start and problem."""
        comparison = of(evaluation)
        law = comparison.law_of(self.law)
        known = _Known(comparison, law, self.initial_condition, self.problems, len(self.starts))
        first = self.first_points(comparison, law)
        random = np.random.default_rng(list(self.seeds[0]))
        spent = evolve(known, known.unit(first), self.evaluations, random)
        problems = list(self.problems) * len(self.starts)
        begin = table_rows(comparison, law, self.initial_condition, first[:, 0], problems, START)
        return joined(
            [
                begin | {EVALUATIONS_SPENT: np.ones(len(problems), dtype=np.int64)},
                known.rows(self.starts, SEARCHED, spent),
            ]
        )

    def first_points(self, comparison: ComparedLaws, law: Law) -> Floats:
        """Return a Latin hypercube sample of the box of each start and problem, (s p, population, n).

        Searches of different laws share the values of the variables they share.
        """
        boxes = [comparison.box(law, comparison.largest_gain(p)) for p in self.problems] * len(self.starts)
        samples = zip(boxes, self.seeds, strict=True)
        return np.stack([latin_hypercube(box, self.population, seed) for box, seed in samples])


@dataclass(frozen=True)
class Onward:
    """Searches of a law by CMA-ES for all problems of an initial condition, from the best of given points.

    What is shared, and what is not, is as in `Evolution`.
    """

    law: str
    initial_condition: str
    problems: tuple[Problem, ...]
    starts: tuple[int | None, ...]
    """Numbers of the starts; None for the one that knows the grids and all others."""
    places: tuple[int, ...]
    """Place in `starts` of each point that is given; every start has one at least."""
    evaluations: int
    """Of each search, besides those of the given points: whole generations."""
    seed: tuple[int, ...]

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the given points, then the best ones of each start and problem."""
        comparison = of(evaluation)
        law = comparison.law_of(self.law)
        known = _Known(comparison, law, self.initial_condition, self.problems, len(self.starts))
        points = law.coordinates(starts)
        given = known.within(points, self.places)
        known(given)
        spent = given.shape[1] + adapt(known, self.evaluations, np.random.default_rng(list(self.seed)))
        like = [self.problems[0]] * len(points)
        begin = table_rows(comparison, law, self.initial_condition, points, like, START)
        begin |= {name: starts[name] for name in law.evaluation.design_variables}
        return joined(
            [begin | {EVALUATIONS_SPENT: np.ones(len(points), dtype=np.int64)}, known.rows(self.starts, ONWARD, spent)]
        )


class _Known:
    """The best points that each start knows for each problem; see `fracctl.comparison.populations.Shared`."""

    def __init__(
        self, comparison: ComparedLaws, law: Law, condition: str, problems: Sequence[Problem], starts: int
    ) -> None:
        self._comparison, self._law, self._problems, self._starts = comparison, law, problems, starts
        self._condition = condition
        self._searched = _watched(law.searched, condition)
        limits = [edges(comparison.box(law, comparison.largest_gain(problem))) for problem in problems]
        self._lower, self._upper = (np.tile(np.stack(ends), (starts, 1)) for ends in zip(*limits, strict=True))
        self.points, self.values = np.zeros_like(self._lower), np.full(len(self._lower), np.inf)

    def __call__(self, points: Floats) -> Floats:
        """Return what each search minimises at its points (m, p, n) of the unit box, (m, p)."""
        count, size, n = points.shape
        each = len(self._problems)
        natural = self.natural(points).reshape(-1, n)
        rows = self._searched(self._law.design(natural))
        told = _told(self._comparison, rows, self._problems).reshape(each, self._starts, each * size)
        place = np.argmin(told, axis=2)
        found = np.take_along_axis(told, place[..., None], axis=2)[..., 0].T.ravel()
        better = found < self.values
        reached = natural.reshape(self._starts, each * size, n)[np.arange(self._starts)[:, None], place.T]
        self.values = np.where(better, found, self.values)
        self.points = np.where(better[:, None], self.unit(reached.reshape(count, n)), self.points)
        own: Floats = told.reshape(each, self._starts, each, size)[np.arange(each), :, np.arange(each)]
        return own.transpose(1, 0, 2).reshape(count, size)

    def within(self, points: Floats, places: Sequence[int]) -> Floats:
        """Return all points (b, n) of each start as points of the unit boxes of its problems, (m, c, n).

        Starts that have fewer of them than others hold the first one several times.
        """
        of_start = [np.flatnonzero(np.equal(places, start)) for start in range(self._starts)]
        most = max(len(own) for own in of_start)
        chosen = np.stack([np.append(own, np.full(most - len(own), own[0])) for own in of_start])
        return self.unit(np.repeat(points[chosen], len(self._problems), axis=0))

    def rows(self, starts: Sequence[int | None], part: str, spent: int) -> dict[str, Array]:
        """Return table rows of the best points, with the numbers of their starts."""
        problems = list(self._problems) * self._starts
        natural = self.natural(self.points)
        rows = table_rows(self._comparison, self._law, self._condition, natural, problems, part)
        numbers = [np.nan if start is None else float(start) for start in starts]
        return rows | {
            "start": np.repeat(numbers, len(self._problems)),
            EVALUATIONS_SPENT: np.full(len(problems), spent),
        }

    def natural(self, points: Floats) -> Floats:
        """Return points of the unit boxes, (m, n) or (m, p, n), in the coordinates of searches."""
        lower, upper = self._ends(points)
        return np.clip(np.round(lower + points * (upper - lower), _DECIMALS), lower, upper)

    def unit(self, points: Floats) -> Floats:
        """Return points, (m, n) or (m, p, n), in the unit boxes; those outside are put on the edge."""
        lower, upper = self._ends(points)
        return np.clip((points - lower) / (upper - lower), 0.0, 1.0)

    def _ends(self, points: Floats) -> tuple[Floats, Floats]:
        each = (slice(None), *[None] * (points.ndim - 2))
        return self._lower[each], self._upper[each]


@dataclass(frozen=True)
class GridSearch:
    """Part of a grid over what is varied; every problem of every initial condition takes the best point of it."""

    law: str
    axes: tuple[tuple[float, ...], ...]
    """Values of each varied parameter, in the coordinates of searches, the last one innermost."""

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:  # noqa: ARG002
        """Return the first point of the grid, then the best one for every initial condition and problem."""
        comparison = of(evaluation)
        law = comparison.law_of(self.law)
        points = np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1).reshape(-1, len(self.axes))
        rows = law.searched(law.design(points))
        problems = list(comparison.problems)
        first = next(iter(comparison.initial_conditions))
        start = table_rows(comparison, law, first, points[:1], problems[:1], START)
        parts = [start | {EVALUATIONS_SPENT: np.ones(1, dtype=np.int64)}]
        for place in range(len(comparison.initial_conditions)):
            own = {name: values[place * len(points) : (place + 1) * len(points)] for name, values in rows.items()}
            best = [int(np.argmin(comparison.admissible(own, problem))) for problem in problems]
            chosen = {name: values[best] for name, values in own.items()}
            table = comparison.table_rows(chosen, self.law, problems, **{PART: GRID})
            count = len(problems)
            parts.append(
                table
                | {EVALUATIONS_SPENT: np.full(count, len(points)), POINT: np.zeros(count, dtype=np.int64)}
                | {SEARCHED_FOR: np.full(count, None, dtype=object)}
            )
        return joined(parts)


def table_rows(
    comparison: ComparedLaws,
    law: Law,
    initial_condition: str,
    points: Floats,
    problems: Sequence[Problem],
    part: str,
) -> dict[str, Array]:
    """Return table rows of points (p, n) in the coordinates of searches, one for each problem."""
    rows = _from(law.searched, initial_condition)(law.design(points))
    table = comparison.table_rows(rows, law.name, problems, **{PART: part})
    return table | {POINT: np.arange(len(points)), SEARCHED_FOR: np.full(len(points), None, dtype=object)}


def edges(box: Sequence[Variable]) -> tuple[Floats, Floats]:
    """Return lower and upper bounds, (n,) each."""
    return np.array([variable.lower for variable in box]), np.array([variable.upper for variable in box])


def of(evaluation: Evaluation) -> ComparedLaws:
    """Return an evaluation as the comparison that it is."""
    assert isinstance(evaluation, ComparedLaws)
    return evaluation


def _told(comparison: ComparedLaws, rows: Mapping[str, Array], problems: Sequence[Problem]) -> Floats:
    """Return what a search for each problem minimises, finite for every row, (p, n)."""
    solved = sound(rows)
    told = []
    for problem in problems:
        values = np.asarray(rows[f"objective_{problem.objective}"], dtype=np.float64)
        settled = np.isfinite(values)
        excess = np.where(solved & settled, comparison.excess(rows, problem), 0.0)
        distance = np.where(solved & ~settled, rows[FinalDistance.name], np.inf)
        admissible = solved & settled & (excess <= 0.0)
        told.append(np.where(admissible, values, penalties(excess, distance)))
    return np.stack(told)


def _watched(evaluation: LawEvaluation, initial_condition: str) -> LawEvaluation:
    alone = _from(evaluation, initial_condition)
    return replace(alone, measures=(*alone.measures, FinalDistance()))


def _from(evaluation: LawEvaluation, initial_condition: str) -> LawEvaluation:
    return replace(evaluation, initial_conditions={initial_condition: evaluation.initial_conditions[initial_condition]})
