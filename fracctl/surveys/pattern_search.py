"""The paper's pattern search over gains, many searches at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.evaluation import Evaluation
from fracctl.surveys.base import EVALUATIONS_SPENT, POINT, SEARCHED_FOR, Rows
from fracctl.surveys.optima import Rank, ranks

_DECIMALS = 12
"""Steps are added in decimals: 4.0 - 0.1 is 3.9."""


@dataclass(frozen=True)
class PatternSearch:
    """A search that moves to the best of the 2n neighbours k_m ± δ until none is better, then takes the next δ.

    Source: Yaylali, Butcher, Sinclair, section "In-plane motion", steps 1-4. Which neighbour is better is decided as
    for optima, with a strict improvement of the objective to move. All searches of a call advance together; no point is
    evaluated twice.
    """

    initial_condition: str
    """The one that is searched for."""
    objective: str
    """Name of what is minimised."""
    variables: tuple[str, ...]
    """The n design variables that are varied."""
    steps: tuple[float, ...]
    """Every δ, in their order."""
    lower: float
    """Least value of a variable."""
    upper: float
    """Largest value of a variable."""

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the paths of all searches, as `fracctl.surveys.base.Search` says."""
        alone = {self.initial_condition: evaluation.initial_conditions[self.initial_condition]}
        known = _Known(replace(evaluation, initial_conditions=alone), self.objective)
        points = np.stack([starts[name] for name in evaluation.design_variables], axis=1)
        walks = [_Walk(number, place, {place}) for number, place in enumerate(known.look_up(points))]
        path = [walk.record() for walk in walks]
        while walks:
            neighbours = [self._neighbours(evaluation, known.points[walk.place], walk.stage) for walk in walks]
            places = iter(known.look_up(np.concatenate(neighbours)))
            for walk, points in zip(walks, neighbours, strict=True):
                if walk.advance([next(places) for _ in points], known.ranks):
                    path.append(walk.record())
            walks = [walk for walk in walks if walk.stage < len(self.steps)]
        number, place, spent = np.array(path).T
        rows = known.rows(place)
        rows[SEARCHED_FOR] = np.full(len(path), self.objective, dtype=object)
        return rows | {EVALUATIONS_SPENT: spent, POINT: number}

    def _neighbours(self, evaluation: Evaluation, point: Sequence[float], stage: int) -> Floats:
        """Return the neighbours of a point within the bounds, (≤ 2n, d)."""
        unit = np.eye(len(point))[[evaluation.design_variables.index(name) for name in self.variables]]
        directions = np.concatenate([unit, -unit])
        moved = np.where(directions, np.round(point + self.steps[stage] * directions, _DECIMALS) + 0.0, point)
        beyond = (directions != 0.0) & ((moved < self.lower) | (moved > self.upper))
        inside: Floats = moved[~beyond.any(axis=1)]
        return inside


@dataclass
class _Walk:
    """One search on its way."""

    number: int
    """Place of its start."""
    place: int
    """Where it stands."""
    seen: set[int]
    """Places of the points it has looked at."""
    stage: int = 0
    """Which δ it is at."""

    def advance(self, neighbours: Sequence[int], rank: Sequence[Rank]) -> bool:
        """Move to the best neighbour, or on to the next δ if none is better; return whether it has moved."""
        self.seen.update(neighbours)
        best = min(neighbours, key=rank.__getitem__, default=self.place)
        moves = rank[best][0] < rank[self.place][0]
        self.place, self.stage = (best, self.stage) if moves else (self.place, self.stage + 1)
        return moves

    def record(self) -> tuple[int, int, int]:
        """Return start, point, and evaluations spent."""
        return self.number, self.place, len(self.seen)


class _Known:
    """Points that are evaluated, each once; numbered by their places."""

    def __init__(self, evaluation: Evaluation, objective: str) -> None:
        self._evaluation, self._objective = evaluation, objective
        self._places: dict[tuple[float, ...], int] = {}
        self._parts: list[Rows] = []
        self.points: list[tuple[float, ...]] = []
        """Design variables by place."""
        self.ranks: list[Rank] = []
        """Ranks by place; the objective of what cannot be an optimum is infinite."""

    def look_up(self, points: Floats) -> list[int]:
        """Return the places of points (p, d); those not known yet are evaluated together."""
        wanted = [tuple(point) for point in points.tolist()]
        new = [point for point in dict.fromkeys(wanted) if point not in self._places]
        if new:
            self._places |= {point: place for place, point in enumerate(new, start=len(self.points))}
            self.points += new
            self._evaluate(np.array(new))
        return [self._places[point] for point in wanted]

    def rows(self, places: Array) -> dict[str, Array]:
        """Return the rows at these places."""
        return {name: column[places] for name, column in joined(self._parts).items()}

    def _evaluate(self, points: Floats) -> None:
        names, objective = self._evaluation.design_variables, self._objective
        rows = self._evaluation(dict(zip(names, np.ascontiguousarray(points.T), strict=True)))
        self.ranks += ranks(rows, objective, self._evaluation.objectives[objective], names)
        self._parts.append(rows)
