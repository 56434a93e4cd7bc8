"""From design points to rows: one evaluation solves, measures and combines a batch."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.controllers.linear import LinearLaw, ModelBasedLaw
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.saturation import Saturation
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop, Need
from fracctl.measures.base import FLOQUET, LoopMeasure, Measure
from fracctl.measures.limits import Limit, excess
from fracctl.plants.linear import LinearPlant
from fracctl.solvers.base import Solver
from fracctl.trajectory import Trajectory

LAW_NUMBER = "law_number"
"""Design variable of evaluations of several laws."""
COUNTERS = ("nodes",)
BEYOND_LIMITS = "beyond_limits"
"""Status of a point that breaks a constraint."""


class ParametrisedLaw(Protocol):
    """A class of laws whose gains and orders have names."""

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return the parameters for a plant with these components."""
        ...

    @classmethod
    def from_parameters(
        cls, components: Sequence[str], values: Mapping[str, Floats | float]
    ) -> LinearLaw | ModelBasedLaw:
        """Build the law from numbers or arrays (b,) by parameter name."""
        ...


@dataclass(frozen=True)
class Conclusion:
    """What an evaluation makes of all rows of a run."""

    tables: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    """Further tables by name, row by row."""
    shown: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    """What the summary holds of them."""
    notes: tuple[str, ...] = ()
    """Sentences for the summary."""
    best: tuple[Mapping[str, Any], ...] = ()
    """Rows that are solved again by the second solver."""

    def beside(self, name: str, records: Sequence[Mapping[str, Any]]) -> Conclusion:
        """Return the same with one more table, that is shown too."""
        return replace(self, tables={**self.tables, name: records}, shown={**self.shown, name: records})


@dataclass(frozen=True)
class Evaluation:
    """How a design point becomes a row for each initial condition.

    Raises:
        ArgumentError: an objective or a constraint names a column that no measure has, or the primary objective is
            unknown.
    """

    plant: LinearPlant
    law: type[ParametrisedLaw]
    parameters: Mapping[str, float]
    """The law's values where the design leaves them alone."""
    initial_conditions: Mapping[str, Floats]
    """State (n,) by name."""
    solver: Solver
    measures: tuple[Measure, ...]
    objectives: Mapping[str, tuple[str, ...]]
    """Columns of measures whose geometric mean each objective is."""
    objective: str
    """Name of the primary objective."""
    horizon: float
    saturation: Saturation | None = field(default=None, kw_only=True)
    """What the thrusters can give; None for any."""
    loop_measures: tuple[LoopMeasure, ...] = field(default=(), kw_only=True)
    """Measures of the loop, the same for all initial conditions."""
    constraints: Mapping[str, Limit] = field(default_factory=dict, kw_only=True)
    """Limits by measured column; what breaks them is no candidate for an optimum."""

    def __post_init__(self) -> None:
        known = list(self.measured_columns)
        named = [(f"objectives.{name}", column) for name, columns in self.objectives.items() for column in columns]
        for where, column in [*named, *(("constraints", column) for column in self.constraints)]:
            if column not in known:
                raise ArgumentError(where, repr(column), f"must name measured columns {known}")
        if self.objective not in self.objectives:
            raise ArgumentError("objective", repr(self.objective), f"must be one of {sorted(self.objectives)}")

    @property
    def has_poles(self) -> bool:
        """Whether a characteristic equation decides on stability."""
        plant: object = self.plant
        return isinstance(plant, LinearPlant) and self.saturation is None

    @cached_property
    def design_variables(self) -> tuple[str, ...]:
        """All parameters of the law, in the order of the columns."""
        return tuple(parameter.name for parameter in self.law.parameters(self.plant.components))

    @cached_property
    def measured_columns(self) -> tuple[str, ...]:
        """Columns of all measures, those of trajectories first."""
        kinds = ([m.columns for m in self.measures], [m.columns for m in self.loop_measures])
        return tuple(itertools.chain.from_iterable(itertools.chain(*kinds)))

    @cached_property
    def row_columns(self) -> tuple[str, ...]:
        """Columns of the rows, in order."""
        objectives = ("objective", *(f"objective_{name}" for name in self.objectives))
        tail = ("status", "stable", "error_estimate", *COUNTERS)
        return ("initial_condition", *self.design_variables, *self.measured_columns, *objectives, *tail)

    @property
    def axes(self) -> Mapping[str, Floats]:
        """What every survey of this evaluation varies besides design variables; values by column."""
        return {}

    def by_law(self, rows: Mapping[str, Array]) -> Iterator[tuple[Evaluation, Array]]:
        """Yield the evaluations whose designs the rows hold, with the places of their rows."""
        yield self, np.arange(len(rows["initial_condition"]))

    def conclude(self, parts: Iterable[Mapping[str, Array]]) -> Conclusion:  # noqa: ARG002 - the optima say it all
        """Return what comes out of all rows, which come part by part."""
        return Conclusion()

    def loop(self, design: Mapping[str, Floats | float]) -> ClosedLoop:
        """Return the closed loop, of a batch where `design` holds arrays."""
        law = self.law.from_parameters(self.plant.components, {**self.parameters, **design})
        return ClosedLoop(self.plant, law, self.saturation)

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the rows of b design points: all points of the first initial condition, then of the next.

        `status` is ``ok``, ``unsettled`` (no settling within the horizon, or a marginal loop), ``unstable``,
        ``diverged``, ``failed`` (certificate not met), the name of the plant's event that ended it, or
        ``beyond_limits`` where all is well but a constraint is broken. Measures of trajectories that do not exist are
        +inf.
        """
        full = self._full_design(design)
        b, k = len(next(iter(full.values()))), len(self.initial_conditions)
        loop = self.loop(full)
        if refusal := self.solver.supports(loop):
            raise UnsupportedError(refusal)
        rows: dict[str, Array] = {"initial_condition": np.repeat(np.array(list(self.initial_conditions), object), b)}
        rows |= {name: np.tile(values, k) for name, values in full.items()}
        states = np.stack(list(self.initial_conditions.values()))
        of_loop: dict[str, Floats] = {}
        for measure in self.loop_measures:
            of_loop |= {name: np.broadcast_to(values, (b,)) for name, values in measure.of_loop(loop).items()}
        for part in self.solver.survey(loop, states, self.horizon):
            where = (np.arange(k)[:, None] * b + part.rows).ravel()
            own = {name: np.tile(values[part.rows], k) for name, values in of_loop.items()}
            for name, values in self._rows(part.trajectory, own).items():
                if name not in rows:
                    rows[name] = np.empty(k * b, dtype=values.dtype)
                rows[name][where] = values
        broken = (rows["status"] == "ok") & (excess(rows, self.constraints) > 0.0)
        rows["status"][broken] = BEYOND_LIMITS
        return {name: rows[name] for name in self.row_columns}

    def solve(self, design: Mapping[str, float], initial_condition: str, horizon: float | None = None) -> Trajectory:
        """Return the trajectory of one design point, over `horizon` or the evaluation's own."""
        state = self.initial_conditions[initial_condition]
        return self.solver.solve(self.loop(design), state, horizon or self.horizon)

    @property
    def sliced_by(self) -> str | None:
        """The one of the `axes` for each value of which an optimum is kept, where the survey names none."""
        return None

    @property
    def trajectory_kinds(self) -> tuple[str, ...]:
        """Kinds of optima whose trajectories are stored."""
        return ("overall", "baseline")

    @property
    def trajectory_samples(self) -> int:
        """How many times of a trajectory are stored, uniform from 0 to the horizon."""
        return 2001

    @property
    def sampled_columns(self) -> tuple[str, ...]:
        """Columns of stored trajectories: states, then controls."""
        return (*self.plant.state_names, *(f"control_{component}" for component in self.plant.components))

    def sampled(self, trajectory: Trajectory, times: Floats) -> dict[str, Floats]:
        """Return the `sampled_columns` of a single trajectory at times (t,), (t,) each."""
        states = trajectory(times)[:, : self.plant.n_states]
        samples = np.concatenate([states, trajectory.control(times)], axis=1)
        return dict(zip(self.sampled_columns, samples.T, strict=True))

    def _full_design(self, design: Mapping[str, Floats]) -> dict[str, Floats]:
        defaults = {p.name: p.default for p in self.law.parameters(self.plant.components)} | dict(self.parameters)
        unknown = set(design) - set(defaults)
        if unknown:
            raise ArgumentError("design", sorted(unknown)[0], f"must name parameters of the law, {sorted(defaults)}")
        given = {name: design.get(name, value) for name, value in defaults.items()}
        arrays = {name: np.atleast_1d(np.asarray(value, dtype=np.float64)) for name, value in given.items()}
        return dict(zip(arrays, map(np.ascontiguousarray, np.broadcast_arrays(*arrays.values())), strict=True))

    @cached_property
    def _judged(self) -> tuple[str, ...]:
        """Columns of trajectories that an unsettled one has infinite; measures may be told of where none minimises."""
        minimised = set(itertools.chain.from_iterable(self.objectives.values()))
        told = {c for m in self.measures if getattr(m, "may_be_infinite", False) for c in m.columns} - minimised
        return tuple(column for measure in self.measures for column in measure.columns if column not in told)

    def _rows(self, trajectory: Trajectory, of_loop: Mapping[str, Floats]) -> dict[str, Array]:
        """Return measures, objectives, status and counters of one group of trajectories."""
        solved = np.isin(trajectory.status, ("ok", "failed"))
        values: dict[str, Array] = {}
        for measure in self.measures:
            if solved.any():
                values |= measure(trajectory)
            else:
                values |= {column: np.full(len(solved), np.inf) for column in measure.columns}
        rows: dict[str, Array] = {**values, **of_loop}
        means = {name: geometric_mean([rows[c] for c in columns]) for name, columns in self.objectives.items()}
        rows["objective"] = means[self.objective]
        rows |= {f"objective_{name}": mean for name, mean in means.items()}
        status = trajectory.status.copy()
        unsettled = np.logical_or.reduce([~np.isfinite(values[name]) for name in self._judged])
        marginal = np.array([self.has_poles and verdict is None for verdict in trajectory.stable], dtype=bool)
        status[(status == "ok") & (unsettled | marginal)] = "unsettled"
        stable = trajectory.stable
        if FLOQUET in of_loop and Need.PERIODIC_PLANT in self.loop({}).needs and self.saturation is None:
            stable = (of_loop[FLOQUET] < 1.0).astype(object)
            status[np.isin(status, ("ok", "unsettled")) & (of_loop[FLOQUET] >= 1.0)] = "unstable"
        rows |= {"status": status, "stable": stable, "error_estimate": trajectory.error_estimate}
        return rows | {name: trajectory.counters[name] for name in COUNTERS}


def geometric_mean(columns: Sequence[Floats]) -> Floats:
    """Return (Π columns)^(1/count), (b,); a single column is returned as it is, infinities stay."""
    if len(columns) == 1:
        return columns[0]
    with np.errstate(invalid="ignore"):
        mean: Floats = np.prod(columns, axis=0) ** (1.0 / len(columns))
    return np.where(np.isinf(np.asarray(columns)).any(axis=0), np.inf, mean)
