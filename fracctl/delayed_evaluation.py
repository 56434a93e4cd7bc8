"""From design points to rows for delayed feedback: every point and start is a run of its own, with its own delay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.controllers import Saturation
from fracctl.design.delays import first_return, natural_period
from fracctl.errors import ArgumentError
from fracctl.evaluation import COUNTERS, Evaluation, geometric_mean
from fracctl.loop import ClosedLoop
from fracctl.measures.largest_multiplier import LargestMultiplier

if TYPE_CHECKING:
    from fracctl.stepwise import StepwiseTrajectory

DELAY = "delay"
ERROR = "periodicity_error"
DIMENSIONLESS = "dimensionless"
AT_ONCE = 64
"""Runs that are solved together; their polynomials are kept, 10 to 100 MB."""
SAMPLES_IN_PERIOD = 100
"""Of a stored trajectory, in 2π of time."""


@dataclass(frozen=True)
class DelayedEvaluation(Evaluation):
    """How a design point becomes a row for each initial condition, for plants in state form under delayed feedback.

    The status of a row is that of its run: ``ok``, the name of the plant's event that ended it, ``diverged`` or
    ``failed``. `stable` is the verdict of the largest multiplier, where that is measured.

    Raises:
        UnsupportedError: the delay is to be the plant's period, but it has none.
        ArgumentError: a measure's unit is not the plant's; or as `Evaluation`.
    """

    delay_from: Literal["given", "period", "first_return"] = "given"
    """Where τ comes from: the law's parameter; the plant's own period; the first return of the free motion from each
    initial condition to the plant's section."""
    saturation: Saturation | None = None
    """What the thrusters can give; None for any."""

    has_poles = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.delay_from == "period":
            natural_period(self.plant)
        for measure in self.measures:
            unit = getattr(measure, "unit", DIMENSIONLESS)
            if self.plant.scales is None and unit != DIMENSIONLESS:
                allowed = "needs a plant with units"
                raise ArgumentError(f"measures.{measure.name}.unit", unit, allowed, f"take {DIMENSIONLESS}")

    def loop(self, design: Mapping[str, Floats | float]) -> ClosedLoop:
        """Return the closed loop from the first initial condition, with the law's own delay."""
        return self._loop(design, next(iter(self.initial_conditions.values())))

    @property
    def trajectory_samples(self) -> int:
        """How many times of a trajectory are stored."""
        return max(2001, 1 + int(SAMPLES_IN_PERIOD * self.horizon / (2.0 * np.pi)))

    @cached_property
    def _delays(self) -> dict[str, float] | None:
        """τ by initial condition, None where the law's parameter decides."""
        if self.delay_from == "given":
            return None
        if self.delay_from == "period":
            return dict.fromkeys(self.initial_conditions, natural_period(self.plant))
        times = np.atleast_1d(first_return(self.plant, np.stack(list(self.initial_conditions.values()))))
        return dict(zip(self.initial_conditions, times.tolist(), strict=True))

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the rows of b design points: all points of the first initial condition, then of the next."""
        full = self._full_design(design)
        b, names = len(next(iter(full.values()))), list(self.initial_conditions)
        table = {name: np.tile(values, len(names)) for name, values in full.items()}
        if self._delays is not None:
            table[DELAY] = np.repeat([self._delays[name] for name in names], b)
        states = np.repeat(np.stack(list(self.initial_conditions.values())), b, axis=0)
        conditions = np.repeat(np.array(names, object), b)
        parts = [
            self._part(
                {name: values[start : start + AT_ONCE] for name, values in table.items()},
                states[start : start + AT_ONCE],
            )
            for start in range(0, len(states), AT_ONCE)
        ]
        rows = joined(parts) | {"initial_condition": conditions}
        return {name: rows[name] for name in self.row_columns}

    def solve(  # type: ignore[override]
        self, design: Mapping[str, float], initial_condition: str, horizon: float | None = None
    ) -> StepwiseTrajectory:
        """Return the trajectory of one design point, over `horizon` or the evaluation's own."""
        state = self.initial_conditions[initial_condition]
        values: dict[str, Any] = dict(design)
        if self._delays is not None:
            values[DELAY] = self._delays[initial_condition]
        trajectory: StepwiseTrajectory = self._solver.solve(self._loop(values, state), state, horizon or self.horizon)
        return trajectory

    @property
    def _solver(self) -> Any:
        return self.solver

    @property
    def sampled_columns(self) -> tuple[str, ...]:
        """Columns of stored trajectories: states, controls, and |x(t) - x(t - τ)|, NaN before τ."""
        return (*super().sampled_columns, ERROR)

    def sampled(self, trajectory: Any, times: Floats) -> dict[str, Floats]:
        """Return the `sampled_columns` of a single trajectory at times (t,), (t,) each."""
        states, controls = trajectory(times), trajectory.control(times)
        delay = float(trajectory.terms[0].delay[0])
        error = np.full(times.size, np.nan)
        late = times >= delay
        error[late] = np.linalg.norm(states[late] - trajectory(np.maximum(times[late] - delay, 0.0)), axis=1)
        samples = np.column_stack([states, controls, error])
        return dict(zip(self.sampled_columns, samples.T, strict=True))

    def _loop(self, values: Mapping[str, Floats | float], states: Floats) -> ClosedLoop:
        law: Any = self.law.from_parameters(self.plant.components, {**self.parameters, **values})
        made = law.for_runs(self.plant, states) if hasattr(law, "for_runs") else law
        return ClosedLoop(self.plant, made, self.saturation)

    def _part(self, table: Mapping[str, Floats], states: Floats) -> dict[str, Array]:
        trajectory: StepwiseTrajectory = self._solver.solve(self._loop(table, states), states, self.horizon)
        return {**table, **self._measured(trajectory)}

    def _measured(self, trajectory: Any) -> dict[str, Array]:
        values: dict[str, Array] = {}
        for measure in self.measures:
            values |= measure(trajectory)
        means = {name: geometric_mean([values[c] for c in columns]) for name, columns in self.objectives.items()}
        rows = values | {"objective": means[self.objective]}
        rows |= {f"objective_{name}": mean for name, mean in means.items()}
        largest = values.get(LargestMultiplier.name, np.full(len(trajectory.status), np.nan))
        stable = np.array([None if np.isnan(value) else bool(value < 1.0) for value in largest], dtype=object)
        rows |= {"status": trajectory.status, "stable": stable, "error_estimate": trajectory.error_estimate}
        return rows | dict.fromkeys(COUNTERS, trajectory.counters["steps"])
