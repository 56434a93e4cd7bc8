"""The searches of a comparison, as workers run them: from seeds, over a grid, and onwards from the best of either."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.comparison.descent import descend
from fracctl.comparison.evaluation import PART, ComparisonEvaluation, sound
from fracctl.comparison.laws import Law, LawEvaluation
from fracctl.comparison.problems import Problem
from fracctl.evaluation import Evaluation
from fracctl.measures.final_distance import FinalDistance
from fracctl.surveys.base import EVALUATIONS_SPENT, POINT, SEARCHED_FOR
from fracctl.surveys.search_algorithms import DIFFERENTIAL_EVOLUTION, Optimiser
from fracctl.surveys.search_run import Variable, latin_hypercube, penalties

START, SEARCHED, GRID, POLISHED = "start", "search", "grid", "polish"
"""Parts of the study that rows of searches belong to; a start counts for nothing but its block."""


@dataclass(frozen=True)
class Evolution:
    """Differential evolution for some problems of one limit, from several starts.

    Each start of each problem has a population of its own. The seeds do not depend on the law, so starts of different
    laws are pairs. Points that are not admissible are told apart as in `fracctl.surveys.search_run.SeededSearch`.
    A start's best point for one problem may come from the population of another one. Where a start has found nothing
    admissible, its row is the point that came nearest to it.
    """

    law: str
    initial_condition: str
    problems: tuple[Problem, ...]
    """They have the same limit."""
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
        law = comparison.law_of(self.law, [problem.threshold_m for problem in self.problems])
        searched = _watched(law.searched, self.initial_condition)
        count, each = len(self.seeds), len(self.problems)
        optimisers = [self._optimiser(comparison, law, seed) for seed in self.seeds]
        first = self.first_points(comparison, law)
        points, values = first.copy(), np.full(count, np.inf)
        generations = self.evaluations // self.population
        for _ in range(generations):
            asked = np.concatenate([optimiser.ask() for optimiser in optimisers])
            rows = searched(law.design(asked))
            told = np.stack([_told(comparison, rows, problem) for problem in self.problems])
            parts = np.arange(len(asked)).reshape(count, -1)
            for number, optimiser in enumerate(optimisers):
                optimiser.tell(told[number % each, parts[number], None])
                together = parts[number - number % each : number - number % each + each].ravel()
                best = together[np.argmin(told[number % each, together])]
                if told[number % each, best] < values[number]:
                    points[number], values[number] = asked[best], told[number % each, best]
        every, spent = comparison.law_of(self.law), generations * self.population
        return joined(
            [
                self._rows(comparison, every, first, START) | {EVALUATIONS_SPENT: np.ones(count, dtype=np.int64)},
                self._rows(comparison, every, points, SEARCHED) | {EVALUATIONS_SPENT: np.full(count, spent)},
            ]
        )

    def first_points(self, comparison: ComparisonEvaluation, law: Law) -> Floats:
        """Return the first point of each population, (s p, n)."""
        return np.stack([self._sample(comparison, law, seed)[0] for seed in self.seeds])

    def _sample(self, comparison: ComparisonEvaluation, law: Law, seed: tuple[int, ...]) -> Floats:
        """Return a first generation; searches of different laws share the values of the variables they share."""
        return latin_hypercube(self._box(comparison, law), self.population, seed)

    def _box(self, comparison: ComparisonEvaluation, law: Law) -> tuple[Variable, ...]:
        return comparison.box(law, comparison.largest_gain(self.problems[0]))

    def _optimiser(self, comparison: ComparisonEvaluation, law: Law, seed: tuple[int, ...]) -> Optimiser:
        lower, upper = edges(self._box(comparison, law))
        number = int(np.random.SeedSequence(seed).generate_state(1)[0])
        return Optimiser(DIFFERENTIAL_EVOLUTION, self._sample(comparison, law, seed), lower, upper, 1, number)

    def _rows(self, comparison: ComparisonEvaluation, law: Law, points: Floats, part: str) -> dict[str, Array]:
        problems = list(self.problems) * len(self.starts)
        starts = np.repeat(self.starts, len(self.problems)).astype(np.float64)
        return table_rows(comparison, law, self.initial_condition, points, problems, part, starts)


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
        start = table_rows(comparison, law, first, points[:1], problems[:1], START, np.array([np.nan]))
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


@dataclass(frozen=True)
class Polish:
    """Pattern searches for several problems of one initial condition, which share all points they look at."""

    law: str
    initial_condition: str
    problems: tuple[Problem, ...]
    """Of each point."""
    start: int | None
    """Number of the start that the points come from; None for the grid."""
    evaluations: int
    """At most, of each problem."""
    seed: tuple[int, ...]

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the points, then where each has led."""
        comparison = of(evaluation)
        law = comparison.law_of(self.law)
        searched = _watched(law.searched, self.initial_condition)
        points = law.coordinates(starts)
        known = searched(law.design(points))
        number = np.full(len(points), np.nan if self.start is None else float(self.start))
        begin = table_rows(comparison, law, self.initial_condition, points, self.problems, START, number)
        begin |= {name: starts[name] for name in law.evaluation.design_variables}
        values = np.array([_told(comparison, known, problem)[i] for i, problem in enumerate(self.problems)])
        limits = [edges(comparison.box(law, comparison.largest_gain(problem))) for problem in self.problems]
        box = np.stack([lower for lower, _ in limits]), np.stack([upper for _, upper in limits])

        def value(around: Floats) -> Floats:
            rows = searched(law.design(around.reshape(-1, around.shape[2])))
            return np.stack([_told(comparison, rows, problem) for problem in self.problems])

        reached = descend(value, points, values, box, self.evaluations, self.seed)
        end = table_rows(comparison, law, self.initial_condition, reached.points, self.problems, POLISHED, number)
        spent = np.repeat([1, reached.evaluations], len(points))
        return joined([begin, end]) | {EVALUATIONS_SPENT: spent}


def table_rows(
    comparison: ComparisonEvaluation,
    law: Law,
    initial_condition: str,
    points: Floats,
    problems: Sequence[Problem],
    part: str,
    starts: Floats,
) -> dict[str, Array]:
    """Return table rows of points (p, n) in the coordinates of searches, one for each problem."""
    rows = _from(law.searched, initial_condition)(law.design(points))
    table = comparison.table_rows(rows, law.name, problems, start=starts, **{PART: part})
    return table | {POINT: np.arange(len(points)), SEARCHED_FOR: np.full(len(points), None, dtype=object)}


def edges(box: Sequence[Variable]) -> tuple[Floats, Floats]:
    """Return lower and upper bounds, (n,) each."""
    return np.array([variable.lower for variable in box]), np.array([variable.upper for variable in box])


def of(evaluation: Evaluation) -> ComparisonEvaluation:
    """Return an evaluation as the comparison that it is."""
    assert isinstance(evaluation, ComparisonEvaluation)
    return evaluation


def _told(comparison: ComparisonEvaluation, rows: Mapping[str, Array], problem: Problem) -> Floats:
    """Return what a search for a problem minimises, finite for every row."""
    values = comparison.admissible(rows, problem)
    settled = np.isfinite(rows[f"objective_{problem.objective}"])
    excess = np.where(sound(rows) & settled, comparison.excess(rows, problem), 0.0)
    distance = np.where(sound(rows) & ~settled, rows[FinalDistance.name], np.inf)
    return np.where(np.isfinite(values), values, penalties(excess, distance))


def _watched(evaluation: LawEvaluation, initial_condition: str) -> LawEvaluation:
    alone = _from(evaluation, initial_condition)
    return replace(alone, measures=(*alone.measures, FinalDistance()))


def _from(evaluation: LawEvaluation, initial_condition: str) -> LawEvaluation:
    return replace(evaluation, initial_conditions={initial_condition: evaluation.initial_conditions[initial_condition]})
