"""The comparison as a survey: searches of every law, then what became of their best points."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.comparison.bounds import BOUND, CURVE, Case, OpenLoopBounds
from fracctl.comparison.evaluation import LAW, OPEN_LOOP, PART, ComparisonEvaluation
from fracctl.comparison.laws import Law, extends
from fracctl.comparison.problems import MOST_GRID_VARIABLES, PEAK, Problem, settling_time_within
from fracctl.comparison.robustness import Robustness
from fracctl.comparison.searches import GRID, SEARCHED, Evolution, GridSearch, Polish
from fracctl.comparison.selection import Selection
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.evaluation import Evaluation
from fracctl.measures import PeakAcceleration
from fracctl.surveys.base import SEARCH_COLUMNS, Block, Rows, Search

SMALLEST_POPULATION = 8
_GRID_BLOCK = 12_000
_CURVE_POINTS = 16
_ABREAST = 8
"""Starts in a block."""

_Asked = tuple[Mapping[str, Floats], Search]


class Comparison:
    """Searches for the best point of every law on every problem, and looks at the best points.

    First a law with three parameters or fewer is computed over grids, one for each largest gain; every other law, and
    the one that others are compared with, gets `starts` searches by differential evolution for every initial condition
    and problem. From the best points of the grids and of each start pattern searches go on, for all problems together;
    so they do, for a law that extends another one as PD^α extends PD, from the best points of that. Then the
    surroundings of the best points are searched for the worst, and linear programmes bound their control effort.

    Args:
        evaluation: `evaluation: comparison`.
        seed: of the run; that of a search depends on it, the start, the initial condition and the problem, not on
            the law.
        starts: number of searches that differ in nothing but the seed.
        evaluations: of each of them by differential evolution, for each problem.
        polish: of each of them by the pattern search, and of each of the `leaders`, for each problem.
        population: points of a generation.
        grid: number of values of each gain, and of all ``orders``, ``times`` and ``weights``; null for no grids.
        leaders: how many of the best points of the grids the pattern searches start from, for each problem.
        interior: points inside the box around a best point.

    Raises:
        ArgumentError: the evaluation is no comparison, or a number is too small.
    """

    columns = SEARCH_COLUMNS
    slices: tuple[str, ...] = ()
    n_points: int | None = None

    def __init__(
        self,
        evaluation: Evaluation,
        seed: int,
        starts: int = 8,
        evaluations: int = 1600,
        polish: int = 400,
        population: int = 32,
        grid: dict[str, int] | None = None,
        leaders: int = 3,
        interior: int = 64,
    ) -> None:
        if not isinstance(evaluation, ComparisonEvaluation):
            raise ArgumentError("type", "comparison", "goes with evaluation=comparison only")
        least = {"starts": 1, "population": SMALLEST_POPULATION, "leaders": 1, "interior": 1}
        given = {"starts": starts, "population": population, "leaders": leaders, "interior": interior}
        for name, value in given.items():
            if value < least[name]:
                raise ArgumentError(name, value, f"must be at least {least[name]}")
        if evaluations < 2 * population:
            raise ArgumentError("evaluations", evaluations, f"must be at least two generations, {2 * population}")
        if polish < 0:
            raise ArgumentError("polish", polish, "must not be negative")
        for name in evaluation.laws:
            refusal = evaluation.solver.supports(evaluation.law_of(name).evaluation.loop({}))
            if refusal:
                raise UnsupportedError(refusal)
        self.baseline: Mapping[str, float] = {}
        self._comparison, self._seed, self._starts = evaluation, seed, starts
        self._evaluations, self._population, self._grid = evaluations, population, dict(grid or {})
        self._polish, self._leaders, self._interior = polish, leaders, interior
        heights = _heights([evaluation.law_of(name) for name in evaluation.laws])
        onward = [partial(self._onward, heights, height) for height in range(1, 1 + max(heights.values()))]
        phases: tuple[Callable[[], Iterator[_Asked]], ...] = (self._searches, self._polishes, *onward, self._studies)
        self._phases = iter(phases)
        self._asked, self._points, self._untold = 0, 0, set[int]()
        self._told: dict[int, Rows] = {}
        self._last = False

    @property
    def finished(self) -> bool:
        """Whether every block has been told."""
        return self._last and not self._untold

    def ask(self) -> list[Block]:
        """Return the blocks of the next phase, once all of the last have been told."""
        blocks: list[Block] = []
        while not blocks and not self._untold and not self._last:
            phase = next(self._phases, None)
            if phase is None:
                self._last = True
            else:
                blocks = [self._block(design, search) for design, search in phase()]
        return blocks

    def tell(self, number: int, rows: Rows) -> None:
        """Take the rows of a block."""
        self._untold.discard(number)
        self._told[number] = rows

    def _block(self, design: Mapping[str, Floats], search: Search) -> Block:
        block = Block(self._asked, self._points, design, search)
        self._untold.add(block.number)
        self._asked, self._points = self._asked + 1, self._points + block.size
        return block

    def _rows(self) -> dict[str, Array]:
        parts = [self._told[number] for number in sorted(self._told)]
        return {name: np.concatenate([part[name] for part in parts]) for name in self._comparison.row_columns}

    def _searches(self) -> Iterator[_Asked]:
        comparison = self._comparison
        for name in comparison.laws:
            yield from self._grids(comparison.law_of(name))
        for limit, condition, name in itertools.product(
            comparison.limits, comparison.initial_conditions, comparison.laws
        ):
            if not self._has_starts(comparison.law_of(name)):
                continue
            problems = tuple(problem for problem in comparison.problems if (problem.limit, problem.value) == limit)
            law = comparison.law_of(name, [problem.threshold_m for problem in problems])
            for first in range(0, self._starts, _ABREAST):
                starts = tuple(range(first, min(first + _ABREAST, self._starts)))
                seeds = tuple(_entropy(self._seed, s, condition, str(problem)) for s in starts for problem in problems)
                search = Evolution(name, condition, problems, starts, seeds, self._population, self._evaluations)
                yield law.searched.natural(law.design(search.first_points(comparison, law))), search

    def _has_starts(self, law: Law) -> bool:
        return not self._has_grid(law) or law.name == self._comparison.reference

    def _has_grid(self, law: Law) -> bool:
        return bool(self._grid) and len(law.varied) <= MOST_GRID_VARIABLES

    def _grids(self, law: Law) -> Iterator[_Asked]:
        """Yield the grids of a law in blocks of whole slices of its first variable."""
        if not self._has_grid(law):
            return
        comparison = self._comparison
        gains = any(parameter.kind == "gain" for parameter in law.varied)
        for largest in sorted({comparison.largest_gain(p) for p in comparison.problems}) if gains else [1.0]:
            box = comparison.box(law, largest)
            axes = [
                tuple(np.round(np.linspace(v.lower, v.upper, self._grid.get(f"{p.kind}s", 0)), 12).tolist())
                for v, p in zip(box, law.varied, strict=True)
            ]
            inner = int(np.prod([len(axis) for axis in axes[1:]]))
            size = max(1, _GRID_BLOCK // inner)
            for begin in range(0, len(axes[0]), size):
                search = GridSearch(law.name, (axes[0][begin : begin + size], *axes[1:]))
                first = np.array([[axis[0] for axis in search.axes]])
                yield law.searched.natural(law.design(first)), search

    def _polishes(self) -> Iterator[_Asked]:
        """Yield pattern searches from the best points of every start, and from the best ones of the grids."""
        comparison, rows = self._comparison, self._rows()
        for name, condition in itertools.product(comparison.laws, comparison.initial_conditions):
            own = (rows[LAW] == name) & (rows["initial_condition"] == condition)
            for part, start in [(SEARCHED, start) for start in range(self._starts)] + [(GRID, None)]:
                chosen = own & (rows[PART] == part) & ((start is None) | (rows["start"] == start))
                if not chosen.any():
                    continue
                found = {column: values[chosen] for column, values in rows.items()}
                for leader in range(1 if part == SEARCHED else self._leaders):
                    yield from self._polished(name, condition, found, start, leader)

    def _polished(self, name: str, condition: str, found: Rows, start: int | None, leader: int) -> Iterator[_Asked]:
        comparison = self._comparison
        variables = comparison.law_of(name).evaluation.design_variables
        points = np.stack([found[variable] for variable in variables], axis=1)
        places, problems = [], []
        for problem in comparison.problems:
            values = comparison.admissible(found, problem)
            order = np.argsort(values, kind="stable")
            _, distinct = np.unique(points[order], axis=0, return_index=True)
            ranked = [place for place in order[np.sort(distinct)] if np.isfinite(values[place])]
            if not ranked and start is not None:
                ranked = np.flatnonzero(_of(found, problem)).tolist()
            if len(ranked) > leader:
                places.append(ranked[leader])
                problems.append(problem)
        if problems and self._polish:
            design = {variable: found[variable][places] for variable in variables}
            seed = _entropy(self._seed, -1 if start is None else start, condition, f"polish {leader}")
            yield design, Polish(name, condition, tuple(problems), start, self._polish, seed)

    def _onward(self, heights: Mapping[str, int], height: int) -> Iterator[_Asked]:
        """Yield pattern searches of laws from the best points, of each start too, of the laws that they extend."""
        comparison = self._comparison
        selection = Selection(comparison, self._rows())
        for name, condition in itertools.product(comparison.laws, comparison.initial_conditions):
            law = comparison.law_of(name)
            below = [other for other in map(comparison.law_of, comparison.laws) if extends(law, other)]
            inner = [one for one in below if not any(extends(other, one) for other in below)]
            if heights[name] == height and inner and self._polish:
                for start in (None, *(range(self._starts) if self._has_starts(law) else ())):
                    yield from self._extended(law, inner, condition, start, selection)

    def _extended(
        self, law: Law, inner: Sequence[Law], condition: str, start: int | None, selection: Selection
    ) -> Iterator[_Asked]:
        comparison, points, problems = self._comparison, list[dict[str, float]](), list[Problem]()
        least = comparison.bounds.get("times", (0.0, 0.0))[0]
        for problem in comparison.problems:
            found = [(row, one) for one in inner if (row := selection.best(one.name, condition, problem, start))]
            if found:
                row, one = min(found, key=lambda pair: float(pair[0]["objective"]))
                points.append(law.point_of(one, row, least))
                problems.append(problem)
        if problems:
            design = {v: np.array([point[v] for point in points]) for v in law.evaluation.design_variables}
            seed = _entropy(self._seed, -1 if start is None else start, condition, "onward")
            yield design, Polish(law.name, condition, tuple(problems), start, self._polish, seed)

    def _studies(self) -> Iterator[_Asked]:
        """Yield the surroundings of the best points, and the bounds."""
        comparison = self._comparison
        selection = Selection(comparison, self._rows())
        for condition in comparison.initial_conditions:
            for name in comparison.laws:
                found = {p: selection.best(name, condition, p) for p in comparison.problems}
                best = {problem: row for problem, row in found.items() if row is not None}
                if best:
                    variables = comparison.law_of(name).by_gains.design_variables
                    design = {v: np.array([row[v] for row in best.values()]) for v in variables}
                    seed = _entropy(self._seed, 0, condition, "robustness")
                    yield design, Robustness(name, condition, tuple(best), self._interior, seed)
            for kind, value in comparison.limits:
                problems = [p for p in comparison.problems if (p.limit, p.value) == (kind, value)]
                cases = self._cases(selection, condition, problems)
                if cases:
                    first = comparison.design_variables[0]
                    yield {first: np.full(len(cases), np.nan)}, OpenLoopBounds(condition, cases)

    def _cases(self, selection: Selection, condition: str, problems: Sequence[Problem]) -> tuple[Case, ...]:
        comparison, cases = self._comparison, list[Case]()
        for problem in problems:
            found = {name: selection.best(name, condition, problem) for name in comparison.laws}
            best = {name: row for name, row in found.items() if row is not None}
            column = settling_time_within(problem.threshold_m)
            for name, row in best.items():
                cases.append(Case(name, BOUND, problem, float(row[column]), float(row[PeakAcceleration.name])))
            if best:
                row = min(best.values(), key=lambda one: one["objective"])
                peak = min(comparison.peak(problem), float(row[PeakAcceleration.name]))
                cases.append(Case(OPEN_LOOP, BOUND, problem, float(row[column]), peak))
        times = [case.time for case in cases if case.time > 0.0]
        if problems[0].limit == PEAK and times:
            for time in np.geomspace(0.5 * min(times), 1.1 * max(times), _CURVE_POINTS).tolist():
                cases.append(Case(OPEN_LOOP, CURVE, problems[0], time, comparison.peak(problems[0])))
        return tuple(case for case in cases if case.time > 0.0)


def _of(rows: Rows, problem: Problem) -> Booleans:
    """Return which rows were found for a problem."""
    own: Booleans = (rows["limit"] == problem.limit) & (rows["limit_value"] == problem.value)
    own &= rows["threshold_m"] == problem.threshold_m
    return own


def _heights(laws: Sequence[Law]) -> dict[str, int]:
    """Return how many laws lie in the longest chain of laws below each, one extending the other."""
    heights: dict[str, int] = {}

    def height(law: Law) -> int:
        if law.name not in heights:
            heights[law.name] = max((1 + height(other) for other in laws if extends(law, other)), default=0)
        return heights[law.name]

    for law in laws:
        height(law)
    return heights


def _entropy(seed: int, start: int, condition: str, purpose: str) -> tuple[int, ...]:
    return (seed, start + 1, *(int.from_bytes(word.encode()) for word in (condition, purpose)))
