"""Seeded searches by a population-based algorithm, several abreast; what a worker runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fracctl.arrays import Array, Booleans, Floats, joined
from fracctl.evaluation import BEYOND_LIMITS, Evaluation
from fracctl.measures import Measure
from fracctl.measures.final_distance import FinalDistance
from fracctl.measures.limits import excess as beyond
from fracctl.surveys.base import EVALUATIONS_SPENT, POINT, SEARCHED_FOR, Rows
from fracctl.surveys.optima import candidates
from fracctl.surveys.search_algorithms import Optimiser, non_dominated

_EXCESS, _UNSETTLED, _WORST = 1e9, 1e12, 1e15
"""Values that points get which are no candidates; no objective is as large."""
_FILTERED_AT_ONCE = 4096


@dataclass(frozen=True)
class Variable:
    """A design variable that is searched over, and its bounds."""

    name: str
    lower: float
    upper: float


@dataclass(frozen=True)
class SeededSearch:
    """A search for one initial condition, from each start with a seed and a budget of its own.

    With one objective the path of a search holds every improvement; with several, all points found that no other
    point found is at least as good as in every objective, and these rows count for all objectives.

    Points without a finite objective are worse than all others. In order, so that the algorithm sees which way is
    better: those beyond the run's constraints, by how far; those that do not settle, by the distance from the
    equilibrium at the horizon; those that are unstable or could not be solved.

    All searches of a call advance together: a solver is fastest with many points at a time.
    """

    algorithm: str
    """One of `fracctl.surveys.search_algorithms.ALGORITHMS`."""
    initial_condition: str
    """The one that is searched for."""
    objectives: tuple[str, ...]
    """Names of what is minimised."""
    variables: tuple[Variable, ...]
    """What is varied."""
    seeds: tuple[tuple[int, ...], ...]
    """Entropy of each start, in their order."""
    population: int
    """Points of a generation."""
    evaluations: int
    """Evaluations of each search, exactly."""
    known: tuple[float, ...] | None = None
    """Values of the variables at a point that every search begins with besides its random ones."""

    def first_generation(self, seed: Sequence[int]) -> Floats:
        """Return the points that the search of a seed begins with, (population, n)."""
        points = latin_hypercube(self.variables, self.population, seed)
        if self.known is not None:
            points[0] = self.known
        return points

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the paths of all searches, as `fracctl.surveys.base.Search` says."""
        alone = {self.initial_condition: evaluation.initial_conditions[self.initial_condition]}
        measures: tuple[Measure, ...] = (*evaluation.measures, FinalDistance())
        watched = replace(evaluation, initial_conditions=alone, measures=measures)
        optimisers = [self._optimiser(seed) for seed in self.seeds]
        records = [_Record(number, len(self.objectives) > 1) for number in range(len(optimisers))]
        for spent in range(0, self.evaluations, self.population):
            asked = [optimiser.ask()[: self.evaluations - spent] for optimiser in optimisers]
            rows = watched(self._design(np.concatenate(asked), starts, len(asked[0])))
            values, admissible = self._values(rows, watched)
            rows = {name: rows[name] for name in evaluation.row_columns}
            parts = np.arange(len(values)).reshape(len(asked), -1)
            for part, optimiser, record in zip(parts, optimisers, records, strict=True):
                record.add({n: v[part] for n, v in rows.items()}, values[part], admissible[part], spent)
                if len(part) == self.population:
                    optimiser.tell(values[part])
        return self._path(records)

    def _optimiser(self, seed: Sequence[int]) -> Optimiser:
        lower, upper = np.array([(variable.lower, variable.upper) for variable in self.variables]).T
        number = int(np.random.SeedSequence(seed).generate_state(1)[0])
        return Optimiser(
            self.algorithm,
            self.first_generation(seed),
            lower,
            upper,
            len(self.objectives),
            number,
        )

    def _design(self, points: Floats, starts: Mapping[str, Floats], size: int) -> dict[str, Floats]:
        """Return all design variables of the points (b·size, n): those that are not varied as in their start."""
        varied = {variable.name: np.ascontiguousarray(points[:, i]) for i, variable in enumerate(self.variables)}
        return {name: np.repeat(values, size) for name, values in starts.items()} | varied

    def _values(self, rows: Rows, evaluation: Evaluation) -> tuple[Floats, Booleans]:
        """Return what is minimised, (n, k), and which rows may be optima, (n,)."""
        values = np.stack([rows[f"objective_{name}"] for name in self.objectives], axis=1)
        objectives = evaluation.objectives
        sound = np.logical_and.reduce([candidates(rows, name, objectives[name]) for name in self.objectives])
        broken = rows["status"] == BEYOND_LIMITS
        excess = np.where(broken, beyond(rows, evaluation.constraints), 0.0)
        distance = np.where(~sound & (rows["status"] == "unsettled"), rows[FinalDistance.name], np.inf)
        return np.where(sound[:, None], values, penalties(excess, distance)[:, None]), sound

    def _path(self, records: Sequence[_Record]) -> dict[str, Array]:
        parts = [record.first for record in records] + [record.found for record in records]
        path = joined(parts)
        one = self.objectives[0] if len(self.objectives) == 1 else None
        path[SEARCHED_FOR] = np.full(len(path[POINT]), one, dtype=object)
        return path


@dataclass
class _Record:
    """The rows of one search that are kept."""

    number: int
    """Place of its start."""
    several: bool
    """Whether it has several objectives."""
    first: Rows = field(default_factory=dict)
    """Its start."""
    _parts: list[Rows] = field(default_factory=list)
    _values: list[Floats] = field(default_factory=list)
    _best: float = np.inf
    _new: int = 0

    def add(self, rows: Rows, values: Floats, admissible: Booleans, spent: int) -> None:
        """Take the rows of a generation, which came after `spent` evaluations."""
        count = len(values)
        rows = dict(rows) | {EVALUATIONS_SPENT: spent + 1 + np.arange(count), POINT: np.full(count, self.number)}
        if not self.first:
            self.first = {name: column[:1] for name, column in rows.items()}
        if self.several:
            kept = np.flatnonzero(admissible)
        else:
            reached = np.minimum.accumulate(np.append(self._best, np.where(admissible, values[:, 0], np.inf)))
            kept = np.flatnonzero(reached[1:] < reached[:-1])
            self._best = float(reached[-1])
        if kept.size:
            self._parts.append({name: column[kept] for name, column in rows.items()})
            self._values.append(values[kept])
            self._new += kept.size
        if self.several and self._new > _FILTERED_AT_ONCE:
            self._filter()

    @property
    def found(self) -> Rows:
        """What the search has found so far."""
        if self.several and self._parts:
            self._filter()
        if not self._parts:
            return {name: column[:0] for name, column in self.first.items()}
        return joined(self._parts)

    def _filter(self) -> None:
        rows, values = joined(self._parts), np.concatenate(self._values)
        front = non_dominated(values)
        self._parts, self._values = [{name: column[front] for name, column in rows.items()}], [values[front]]
        self._new = 0


def latin_hypercube(variables: Sequence[Variable], population: int, seed: Sequence[int]) -> Floats:
    """Return a Latin hypercube sample of a box, (p, n); each variable has a random stream of its own.

    So searches of different laws with one seed begin with the same values of the variables that they share.
    """
    columns = []
    for variable in variables:
        random = np.random.default_rng([*seed, *variable.name.encode()])
        places = (random.permutation(population) + random.random(population)) / population
        columns.append(variable.lower + places * (variable.upper - variable.lower))
    return np.stack(columns, axis=1)


def penalties(excess: Floats, distance: Floats) -> Floats:
    """Return what points that are no candidates count as, (n,): more than any objective.

    In order, so that an algorithm sees which way is better: those beyond limits, by their `excess` over them where it
    is positive; those that do not settle, by their `distance` at the horizon where it is finite; all others.
    """
    values = np.where(np.isfinite(distance), _UNSETTLED * (1.0 + np.minimum(distance, 100.0)), _WORST)
    return np.where(excess > 0.0, _EXCESS * (1.0 + np.minimum(excess, 100.0)), values)
