"""Stochastic search over gains and orders together, from many seeds, for each objective and initial condition."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import numpy as np

from fracctl.arrays import Floats
from fracctl.controllers import Parameter
from fracctl.errors import ArgumentError, suggestion
from fracctl.evaluation import Evaluation
from fracctl.surveys.base import SEARCH_COLUMNS, Block, Rows
from fracctl.surveys.search_algorithms import NSGA2
from fracctl.surveys.search_run import SeededSearch, Variable

ABREAST = 4
"""Starts in a block: more are faster, fewer leave more blocks for other processes."""
SMALLEST_POPULATION = 8
KINDS = ("gains", "orders", "times", "weights")
"""Words for all design variables of a kind."""


class PopulationSearch:
    """Independent searches by differential evolution, CMA-ES or NSGA-II, each within an exact number of evaluations.

    Every search is repeated from `starts` seeds for each objective (NSGA-II: for all of them at once) and initial
    condition, and with a baseline once more with these values held fixed and the same seeds; what is compared
    then differs in nothing else. A seed depends on the run's, the start, the initial condition and the objective, not
    on the law, so searches of different laws are pairs too.

    Args:
        evaluation: whose law's parameters are varied.
        seed: of the run.
        bounds: [lower, upper] by design variable, or for all `gains`, `orders`, `times` or `weights`.
        algorithm: ``differential_evolution`` (DE/best/1/bin), ``cma_es``, or ``nsga2`` for a Pareto front.
        evaluations: budget of each search, at least one generation.
        starts: number of searches that differ in nothing but the seed.
        population: points of a generation, at least 8.
        vary: design variables, or kinds of them as in `bounds`; all others keep the controller's values. None for all.
        objectives: names of the run's objectives; None for the primary one, with NSGA-II for all.
        baseline: values of varied variables that the searches compared with hold fixed.
        from_controller: whether the controller's values are a point of every first generation, for laws of which few
            gains settle at all.

    Raises:
        ArgumentError: a name is unknown, a bound or a baseline lies outside the range of its variable, a number is too
            small, or NSGA-II has less than two objectives.
    """

    columns = SEARCH_COLUMNS
    slices: tuple[str, ...] = ()

    def __init__(
        self,
        evaluation: Evaluation,
        seed: int,
        bounds: dict[str, list[float]],
        algorithm: Literal["differential_evolution", "cma_es", "nsga2"] = "differential_evolution",
        evaluations: int = 100_000,
        starts: int = 8,
        population: int = 96,
        vary: Sequence[str] | None = ("gains", "orders"),
        objectives: Sequence[str] | None = None,
        baseline: dict[str, float] | None = None,
        from_controller: bool = False,
    ) -> None:
        parameters = {p.name: p for p in evaluation.law.parameters(evaluation.plant.components)}
        variables = _variables(parameters, list(parameters) if vary is None else vary, bounds)
        self.baseline: Mapping[str, float] = dict(baseline or {})
        free = _without(self.baseline, variables, parameters)
        _check_size("starts", starts, 1)
        _check_size("population", population, SMALLEST_POPULATION)
        _check_size("evaluations", evaluations, population)
        aims = _aims(algorithm, objectives, evaluation)
        groups = [range(first, min(first + ABREAST, starts)) for first in range(0, starts, ABREAST)]
        held = dict(evaluation.parameters)
        kinds = [(variables, held)] + ([(free, held | self.baseline)] if self.baseline else [])
        self._blocks: list[Block] = []
        self.n_points = 0
        for group, aim, condition, (varied, fixed) in itertools.product(
            groups, aims, evaluation.initial_conditions, kinds
        ):
            seeds = tuple(_entropy(seed, start, condition, aim) for start in group)
            known = _known(varied, held) if from_controller else None
            search = SeededSearch(algorithm, condition, aim, varied, seeds, population, evaluations, known)
            self._blocks.append(Block(len(self._blocks), self.n_points, _starts(search, fixed), search))
            self.n_points += len(seeds)
        self._untold = {block.number for block in self._blocks}

    @property
    def finished(self) -> bool:
        """Whether every block has been told."""
        return not self._untold

    def ask(self) -> list[Block]:
        """Return all blocks, once."""
        blocks, self._blocks = self._blocks, []
        return blocks

    def tell(self, number: int, rows: Rows) -> None:  # noqa: ARG002 - searches do not depend on each other
        """Note that a block is done."""
        self._untold.discard(number)


def _known(variables: Sequence[Variable], values: Mapping[str, float]) -> tuple[float, ...]:
    """Return the point of the controller; raise ArgumentError where it lies outside the bounds."""
    for variable in variables:
        if not variable.lower <= values[variable.name] <= variable.upper:
            allowed = f"needs controller.{variable.name} = {values[variable.name]:g} within its bounds"
            raise ArgumentError("from_controller", True, f"{allowed} [{variable.lower:g}, {variable.upper:g}]")
    return tuple(values[variable.name] for variable in variables)


def _starts(search: SeededSearch, held: Mapping[str, float]) -> dict[str, Floats]:
    """Return the first point of each search; what is not varied is as in `held`."""
    points = np.stack([search.first_generation(seed)[0] for seed in search.seeds])
    varied = {variable.name: np.ascontiguousarray(points[:, i]) for i, variable in enumerate(search.variables)}
    return {name: np.full(len(points), float(value)) for name, value in held.items()} | varied


def _variables(
    parameters: Mapping[str, Parameter], vary: Iterable[str], bounds: Mapping[str, Sequence[float]]
) -> tuple[Variable, ...]:
    """Return the variables that are searched over, in the order of the columns."""
    known = [*parameters, *dict.fromkeys(f"{parameter.kind}s" for parameter in parameters.values())]
    for name in vary:
        _check_name("vary", name, known)
    for name in bounds:
        _check_name(f"bounds.{name}", name, list(dict.fromkeys([*known, *KINDS])))
    wanted = [p for p in parameters.values() if p.name in vary or f"{p.kind}s" in vary]
    if not wanted:
        raise ArgumentError("vary", list(vary), f"must name at least one of {', '.join(known)}")
    return tuple(_variable(parameter, bounds) for parameter in wanted)


def _variable(parameter: Parameter, bounds: Mapping[str, Sequence[float]]) -> Variable:
    name = parameter.name
    key = name if name in bounds else f"{parameter.kind}s"
    if key not in bounds:
        allowed = f"must hold [lower, upper] for {name}, which is varied, or for all {key}"
        raise ArgumentError("bounds", list(bounds), allowed)
    ends = bounds[key]
    if len(ends) != 2 or not ends[0] < ends[1]:
        raise ArgumentError(f"bounds.{key}", list(ends), "must be [lower, upper], the lower one first")
    for end in ends:
        if not parameter.contains(end):
            raise ArgumentError(f"bounds.{key}", list(ends), f"{parameter.allowed}, for it bounds {name}")
    return Variable(name, float(ends[0]), float(ends[1]))


def _without(
    baseline: Mapping[str, float], variables: Sequence[Variable], parameters: Mapping[str, Parameter]
) -> tuple[Variable, ...]:
    """Return the variables that are free in the searches that are compared with."""
    for name, value in baseline.items():
        _check_name(f"baseline.{name}", name, [variable.name for variable in variables])
        if not parameters[name].contains(value):
            raise ArgumentError(f"baseline.{name}", value, parameters[name].allowed)
    free = tuple(variable for variable in variables if variable.name not in baseline)
    if not free:
        raise ArgumentError("baseline", dict(baseline), "must leave at least one varied variable free")
    return free


def _check_size(name: str, value: int, least: int) -> None:
    if value < least:
        raise ArgumentError(name, value, f"must be at least {least}")


def _aims(algorithm: str, objectives: Sequence[str] | None, evaluation: Evaluation) -> list[tuple[str, ...]]:
    """Return the objectives of each search."""
    several = algorithm == NSGA2
    if objectives is not None and not objectives:
        raise ArgumentError("objectives", [], f"must be null or name one of {', '.join(evaluation.objectives)}")
    names = list(objectives or (evaluation.objectives if several else [evaluation.objective]))
    for name in names:
        _check_name("objectives", name, list(evaluation.objectives))
    if not several:
        return [(name,) for name in names]
    if len(names) < 2:
        cure = "differential_evolution and cma_es take one"
        raise ArgumentError("objectives", names, f"must be two at least for a Pareto front by {NSGA2}", cure)
    return [tuple(names)]


def _check_name(argument: str, name: str, known: Sequence[str]) -> None:
    if name not in known:
        raise ArgumentError(argument, name, f"must name one of {', '.join(known)}{suggestion(name, known)}")


def _entropy(seed: int, start: int, condition: str, aim: Sequence[str]) -> tuple[int, ...]:
    return (seed, start, *(int.from_bytes(word.encode()) for word in (condition, "/".join(aim))))
