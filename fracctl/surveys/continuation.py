"""Optimal gains for every order: pattern searches outward from a start, each from the optima of its neighbours."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.evaluation import Evaluation
from fracctl.surveys.axes import axis_values
from fracctl.surveys.base import POINT, SEARCH_COLUMNS, Block, Rows
from fracctl.surveys.lqr_seed import LQRWeights, starting_point
from fracctl.surveys.optima import Rank, ranks
from fracctl.surveys.pattern_search import PatternSearch

MOST_POINTS = 10_000
"""More combinations of the axes' values than this are taken for a mistyped step."""

_Place = tuple[int, ...]
"""Numbers of values, one an axis."""
_Fronts = list[list[tuple[_Place, _Place]]]


class Continuation:
    """Searches for the best gains at every order, outward from a start, each from the optima of its neighbours.

    The first search starts from the controller's gains or from LQR's. Then front follows front: all points that lie one
    step of an axis farther out, each searched from the optimum of every neighbour nearer to the start; the best is kept
    (Yaylali, Butcher, Sinclair, section "In-plane motion", where which neighbour is taken is not said). Every initial
    condition and objective has searches of its own. A block is one front of one of them; its points are searches.

    Args:
        evaluation: of design points.
        seed: not used.
        axes: ``start:stop:step``, a number or a list of values, by order.
        start: the value of each axis to start from.
        first_steps: every δ of the first search.
        steps: every δ of the others.
        bounds: least and largest gain.
        lqr: weights of the LQR gains to start from; None for the controller's gains.
        objectives: what is searched for; None for all objectives.

    Raises:
        ArgumentError: an argument is out of its range.
        ConfigurationError: the law has no gains.
    """

    columns = SEARCH_COLUMNS

    def __init__(
        self,
        evaluation: Evaluation,
        seed: int,  # noqa: ARG002 - as every survey
        axes: dict[str, Any],
        start: dict[str, float],
        first_steps: list[float],
        steps: list[float],
        bounds: list[float],
        lqr: LQRWeights | None = None,
        objectives: list[str] | None = None,
    ) -> None:
        self._evaluation = evaluation
        gains = _gains(evaluation)
        self._axes = _checked_axes(evaluation, axes, start)
        self._point = starting_point(evaluation, lqr) | start
        self._tracks = [
            (ic, name) for name in _objectives(evaluation, objectives) for ic in evaluation.initial_conditions
        ]
        self._steps = [_steps("first_steps", first_steps), _steps("steps", steps)]
        self._bounds = _bounds(bounds, {name: self._point[name] for name in gains})
        self._gains = gains
        self._fronts = _fronts([values.tolist().index(start[name]) for name, values in self._axes.items()], self._axes)
        self.slices = tuple(self._axes)
        self.baseline: Mapping[str, float] = dict(start)
        self._best: list[dict[_Place, Rank]] = [{} for _ in self._tracks]
        self._ready = [(track, 0) for track in range(len(self._tracks))]
        self._told = 0

    @property
    def n_points(self) -> int:
        """Number of searches."""
        return len(self._tracks) * sum(map(len, self._fronts))

    @property
    def finished(self) -> bool:
        """Whether every block has been told."""
        return self._told == len(self._tracks) * len(self._fronts)

    def ask(self) -> list[Block]:
        """Return the next front of every track whose last one is done."""
        ready, self._ready = self._ready, []
        return [self._block(track, front) for track, front in ready]

    def tell(self, number: int, rows: Rows) -> None:
        """Keep the best point of every place of a front; the next front of its track may run."""
        track, front = divmod(number, len(self._fronts))
        objective = self._tracks[track][1]
        factors, names = self._evaluation.objectives[objective], self._evaluation.design_variables
        first = self._first_point(track, front)
        best = self._best[track]
        for point, rank in zip(rows[POINT].tolist(), ranks(rows, objective, factors, names), strict=True):
            place = self._fronts[front][point - first][0]
            best[place] = min(rank, best.get(place, rank))
        self._told += 1
        if front + 1 < len(self._fronts):
            self._ready.append((track, front + 1))

    def _first_point(self, track: int, front: int) -> int:
        sizes = [len(searches) for searches in self._fronts]
        return track * sum(sizes) + sum(sizes[:front])

    def _block(self, track: int, front: int) -> Block:
        names = self._evaluation.design_variables
        starts = np.array([self._start(track, *search) for search in self._fronts[front]])
        design = dict(zip(names, np.ascontiguousarray(starts.T), strict=True))
        search = PatternSearch(*self._tracks[track], self._gains, self._steps[min(front, 1)], *self._bounds)
        return Block(track * len(self._fronts) + front, self._first_point(track, front), design, search)

    def _start(self, track: int, place: _Place, neighbour: _Place) -> list[float]:
        """The best point of a neighbour, moved to the orders of a place."""
        names = self._evaluation.design_variables
        found = self._best[track].get(neighbour)
        point = self._point if found is None else dict(zip(names, found[-len(names) :], strict=True))
        orders = {name: float(values[i]) for (name, values), i in zip(self._axes.items(), place, strict=True)}
        return [{**point, **orders}[name] for name in names]


class PatternSearchSurvey(Continuation):
    """Searches for the best gains at the controller's orders, for each initial condition and objective.

    Args:
        evaluation: of design points.
        seed: not used.
        steps: every δ.
        bounds: least and largest gain.
        lqr: weights of the LQR gains to start from; None for the controller's gains.
        objectives: what is searched for; None for all objectives.

    Raises:
        ArgumentError: an argument is out of its range.
        ConfigurationError: the law has no gains.
    """

    def __init__(
        self,
        evaluation: Evaluation,
        seed: int,
        steps: list[float],
        bounds: list[float],
        lqr: LQRWeights | None = None,
        objectives: list[str] | None = None,
    ) -> None:
        super().__init__(evaluation, seed, {}, {}, steps, steps, bounds, lqr, objectives)


def _fronts(start: Sequence[int], axes: Mapping[str, Floats]) -> _Fronts:
    """Searches by distance from the start: places with each of their nearer neighbours."""
    places = list(itertools.product(*(range(len(values)) for values in axes.values())))
    distance = {place: sum(abs(i - j) for i, j in zip(place, start, strict=True)) for place in places}
    fronts: _Fronts = [[] for _ in range(max(distance.values()) + 1)]
    for place in places:
        nearer = []
        for k, (i, j) in enumerate(zip(place, start, strict=True)):
            if i != j:
                nearer.append((*place[:k], i + (1 if i < j else -1), *place[k + 1 :]))
        fronts[distance[place]] += [(place, neighbour) for neighbour in nearer or [place]]
    return fronts


def _gains(evaluation: Evaluation) -> tuple[str, ...]:
    parameters = evaluation.law.parameters(evaluation.plant.components)
    gains = tuple(parameter.name for parameter in parameters if parameter.kind == "gain")
    if not gains:
        names = ", ".join(parameter.name for parameter in parameters)
        raise ConfigurationError(f"the search varies gains, but the controller has none ({names}); choose another one")
    return gains


def _objectives(evaluation: Evaluation, given: Sequence[str] | None) -> list[str]:
    known = list(evaluation.objectives)
    if not known:
        raise ConfigurationError("the search minimises objectives, but the evaluation has none; choose another one")
    if given is None:
        return known
    for name in given:
        if name not in known:
            raise ArgumentError(
                "objectives", given, f"must name objectives of the run ({', '.join(known)}), or be null"
            )
    if not given or len(set(given)) < len(given):
        raise ArgumentError("objectives", given, "must name at least one objective, and none twice")
    return list(given)


def _checked_axes(evaluation: Evaluation, axes: Mapping[str, Any], start: Mapping[str, float]) -> dict[str, Floats]:
    parameters = {p.name: p for p in evaluation.law.parameters(evaluation.plant.components) if p.kind != "gain"}
    values = {}
    for name, spec in axes.items():
        if name not in parameters:
            known = ", ".join(parameters) or "this law has none"
            raise ArgumentError(f"axes.{name}", spec, f"must name a parameter that is no gain ({known})")
        values[name] = axis_values(spec, f"axes.{name}")
        outside = [value for value in values[name].tolist() if not parameters[name].contains(value)]
        if outside:
            raise ArgumentError(f"axes.{name}", outside[0], f"{parameters[name].allowed}, but holds {outside[0]:g}")
        if name not in start:
            raise ArgumentError("start", dict(start), f"must hold a value of {name}, for it is an axis")
        if start[name] not in values[name].tolist():
            raise ArgumentError(f"start.{name}", start[name], "must be one of the values of its axis")
    for name, value in start.items():
        if name not in axes:
            raise ArgumentError(f"start.{name}", value, f"must name an axis ({', '.join(axes)})")
    if (points := math.prod(map(len, values.values()))) > MOST_POINTS:
        raise ArgumentError("axes", dict(axes), f"must make at most {MOST_POINTS} points, but make {points}")
    return values


def _steps(name: str, steps: Sequence[float]) -> tuple[float, ...]:
    if not steps or not all(math.isfinite(step) and step > 0.0 for step in steps):
        raise ArgumentError(name, list(steps), "must hold at least one step, all of them positive")
    return tuple(map(float, steps))


def _bounds(bounds: Sequence[float], start: Mapping[str, float]) -> tuple[float, float]:
    if len(bounds) != 2 or not bounds[0] < bounds[1]:
        raise ArgumentError("bounds", list(bounds), "must hold the least and the largest gain")
    lower, upper = map(float, bounds)
    outside = [f"{name} = {value:g}" for name, value in start.items() if not lower <= value <= upper]
    if outside:
        raise ArgumentError("bounds", list(bounds), f"must hold the gains of the start, but not {outside[0]}")
    return lower, upper
