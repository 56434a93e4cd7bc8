"""The comparison as a survey: searches of every law, then what became of their best points."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.comparison.bounds import BOUND, CURVE, Case, OpenLoopBounds
from fracctl.comparison.compared import check_kind
from fracctl.comparison.evaluation import ComparisonEvaluation
from fracctl.comparison.laws import Law
from fracctl.comparison.problems import LAW, MOST_GRID_VARIABLES, OPEN_LOOP, PART, PEAK, Problem, settling_time_within
from fracctl.comparison.robustness import Robustness
from fracctl.comparison.searches import START, Evolution, GridSearch, Onward
from fracctl.comparison.selection import Selection
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.evaluation import Evaluation
from fracctl.measures import PeakAcceleration
from fracctl.surveys.base import SEARCH_COLUMNS, Block, Rows, Search
from fracctl.surveys.search import KINDS

SMALLEST_POPULATION = 8
_GRID_BLOCK = 12_000
_FEWEST_VALUES = 2
_CURVE_POINTS = 16
_ABREAST = 8
"""Starts in a block."""

_Asked = tuple[Mapping[str, Floats], Search]


class Comparison:
    """Searches for the best point of every law on every problem, and looks at the best points.

    First a law with three parameters or fewer is computed over grids, one for each largest gain; every other law, and
    the one that others are compared with, is searched from `starts` starts for all problems of an initial condition.
    Then come rounds, in which each law is searched anew from the best points of all laws, put into its own parameters:
    all laws look where one of them has been successful, and a difference between them is not one of luck. Starts learn
    of the same start of other laws only; the grids are one more start, which learns of all. Then the surroundings of
    the best points are searched for the worst, and linear programmes bound their control effort.

    Args:
        evaluation: `evaluation: comparison`.
        seed: of the run; that of a search depends on it, the start, the initial condition and the problem, not on
            the law.
        starts: number of searches that differ in nothing but the seed.
        evaluations: of the first search by differential evolution, for each start and problem.
        rounds: after it.
        polish: of a round by CMA-ES, likewise.
        population: points of a generation.
        grid: number of values of all ``gains``, ``orders``, ``times`` and ``weights``; null for no grids.
        interior: points inside the box around a best point.

    Raises:
        ArgumentError: the evaluation is no comparison, a number is too small, or a grid lacks a kind of parameter or
            names none.
    """

    columns = SEARCH_COLUMNS
    slices: tuple[str, ...] = ()
    n_points: int | None = None

    def __init__(
        self,
        evaluation: Evaluation,
        seed: int,
        starts: int = 5,
        evaluations: int = 4480,
        rounds: int = 3,
        polish: int = 640,
        population: int = 64,
        grid: dict[str, int] | None = None,
        interior: int = 64,
    ) -> None:
        if not isinstance(evaluation, ComparisonEvaluation):
            raise ArgumentError("type", "comparison", "goes with evaluation=comparison only")
        least = {"starts": 1, "population": SMALLEST_POPULATION, "interior": 1}
        given = {"starts": starts, "population": population, "interior": interior}
        for name, value in given.items():
            if value < least[name]:
                raise ArgumentError(name, value, f"must be at least {least[name]}")
        if evaluations < 2 * population:
            raise ArgumentError("evaluations", evaluations, f"must be at least two generations, {2 * population}")
        for name, value in (("rounds", rounds), ("polish", polish)):
            if value < 0:
                raise ArgumentError(name, value, "must not be negative")
        for name in evaluation.laws:
            refusal = evaluation.solver.supports(evaluation.law_of(name).evaluation.loop({}))
            if refusal:
                raise UnsupportedError(refusal)
        self.baseline: Mapping[str, float] = {}
        self._comparison, self._seed, self._starts = evaluation, seed, starts
        self._evaluations, self._population, self._grid = evaluations, population, dict(grid or {})
        self._polish, self._interior = polish, interior
        self._check_grid()
        onward = [partial(self._onward, number) for number in range(1, 1 + rounds)]
        phases: tuple[Callable[[], Iterator[_Asked]], ...] = (self._searches, *onward, self._studies)
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
        for condition, name in itertools.product(comparison.initial_conditions, comparison.laws):
            law = comparison.law_of(name)
            for starts in self._abreast() if self._has_starts(law) else ():
                seeds = tuple(_entropy(self._seed, s, condition, str(p)) for s in starts for p in comparison.problems)
                budget = self._population, self._evaluations
                search = Evolution(name, condition, comparison.problems, starts, seeds, *budget)
                yield law.searched.natural(law.design(search.first_points(comparison, law)[:, 0])), search

    def _check_grid(self) -> None:
        for kind, count in self._grid.items():
            check_kind("grid", kind, count, KINDS)
            if count < _FEWEST_VALUES:
                raise ArgumentError(f"grid.{kind}", count, f"must be at least {_FEWEST_VALUES}, both ends of the range")
        for law in map(self._comparison.law_of, self._comparison.laws):
            for parameter in law.varied if self._has_grid(law) else ():
                if f"{parameter.kind}s" not in self._grid:
                    allowed = f"must hold a number of {parameter.kind}s, for {law.name} varies {parameter.name}"
                    raise ArgumentError("grid", self._grid, allowed, "survey.grid=null is for no grids")

    def _abreast(self) -> list[tuple[int, ...]]:
        numbers = range(self._starts)
        return [tuple(numbers[first : first + _ABREAST]) for first in range(0, self._starts, _ABREAST)]

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
                tuple(np.round(np.linspace(v.lower, v.upper, self._grid[f"{p.kind}s"]), 12).tolist())
                for v, p in zip(box, law.varied, strict=True)
            ]
            inner = int(np.prod([len(axis) for axis in axes[1:]]))
            size = max(1, _GRID_BLOCK // inner)
            for begin in range(0, len(axes[0]), size):
                search = GridSearch(law.name, (axes[0][begin : begin + size], *axes[1:]))
                first = np.array([[axis[0] for axis in search.axes]])
                yield law.searched.natural(law.design(first)), search

    def _onward(self, number: int) -> Iterator[_Asked]:
        """Yield searches of all laws from the best points, of each start too, of all of them."""
        comparison, rows = self._comparison, self._rows()
        selection = Selection(comparison, rows)
        for condition, name in itertools.product(comparison.initial_conditions, comparison.laws):
            law = comparison.law_of(name)
            groups: list[tuple[int | None, ...]] = [*self._abreast()] if self._has_starts(law) else []
            for group in [*groups, (None,)] if self._grid else groups:
                found = {start: self._known(law, condition, start, selection, rows) for start in group}
                starts = tuple(start for start in group if found[start])
                points = [(place, point) for place, start in enumerate(starts) for point in found[start]]
                if points and self._polish:
                    places = tuple(place for place, _ in points)
                    design = {v: np.array([point[v] for _, point in points]) for v in law.evaluation.design_variables}
                    seed = _entropy(self._seed, -1 if starts[0] is None else starts[0], condition, f"round {number}")
                    yield design, Onward(name, condition, comparison.problems, starts, places, self._polish, seed)

    def _known(
        self, law: Law, condition: str, start: int | None, selection: Selection, rows: Rows
    ) -> list[dict[str, float]]:
        """Return the best points that a start of all laws has found, in the parameters of a law, each of them once."""
        comparison, points = self._comparison, dict[tuple[float, ...], dict[str, float]]()
        variables = law.evaluation.design_variables
        lag = comparison.bounds.get("times", (0.0, 0.0))[0]
        for name in comparison.laws if law.evaluation.weighed_by is None else (law.name,):
            other = comparison.law_of(name)
            for problem in comparison.problems:
                row = selection.own(name, condition, problem, start)
                if row is not None:
                    point = {v: row[v] for v in variables} if name == law.name else law.point_of(other, row, lag)
                    points.setdefault(tuple(point.values()), point)
        if not points:
            own = (rows[LAW] == law.name) & (rows["initial_condition"] == condition) & (rows["start"] == start)
            for place in np.flatnonzero(own & (rows[PART] != START)):
                point = {v: float(rows[v][place]) for v in variables}
                points.setdefault(tuple(point.values()), point)
        return list(points.values())

    def _studies(self) -> Iterator[_Asked]:
        """Yield the surroundings of the best points, and the bounds."""
        comparison = self._comparison
        selection = Selection(comparison, self._rows())
        for condition in comparison.initial_conditions:
            for name in comparison.laws:
                found = {p: selection.best(name, condition, p) for p in comparison.problems}
                best = {problem: row for problem, row in found.items() if row is not None and row[LAW] == name}
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
            best = {name: row for name, row in found.items() if row is not None and row[LAW] == name}
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


def _entropy(seed: int, start: int, condition: str, purpose: str) -> tuple[int, ...]:
    return (seed, start + 1, *(int.from_bytes(word.encode()) for word in (condition, purpose)))
