"""From design points to rows for delayed feedback: every point and start is a run of its own, with its own delay."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.design.delays import first_return, natural_period
from fracctl.errors import ArgumentError
from fracctl.evaluation import COUNTERS, Conclusion, Evaluation, geometric_mean
from fracctl.loop import ClosedLoop
from fracctl.measures.largest_multiplier import LargestMultiplier
from fracctl.plants.capabilities import SectionedPlant, period_of
from fracctl.plants.state import StatePlant
from fracctl.stability.windows import windows

if TYPE_CHECKING:
    from fracctl.stepwise import StepwiseTrajectory

DELAY = "delay"
ERROR = "periodicity_error"
DIMENSIONLESS = "dimensionless"
AT_ONCE = 64
"""Runs that are solved together; their polynomials are kept, 10 to 100 MB."""
SAMPLES_IN_PERIOD = 100
"""Of a stored trajectory, in 2π of time."""
_NEEDED_OF_PLANTS = {"period": ("period", "first_return or given"), "first_return": ("section", "period or given")}


def _has(plant: object, needed: str) -> bool:
    return period_of(plant) is not None if needed == "period" else isinstance(plant, SectionedPlant)


@dataclass(frozen=True)
class DelayedEvaluation(Evaluation):
    """How a design point becomes a row for each initial condition, for plants in state form under delayed feedback.

    The status of a row is that of its run: ``ok``, the name of the plant's event that ended it, ``diverged`` or
    ``failed``. `stable` is the verdict of the largest multiplier, where that is measured.

    Raises:
        ArgumentError: the plant lacks the period or the section that the delay is to come from; a measure's unit or
            guess is not the plant's; or as `Evaluation`.
    """

    delay_from: Literal["given", "period", "first_return"] = "given"
    """Where τ comes from: the law's parameter; the plant's own period; the first return of the free motion from each
    initial condition to the plant's section."""

    @property
    def has_poles(self) -> bool:
        """Never: delays have an equation of their own, with infinitely many."""
        return False

    def __post_init__(self) -> None:
        super().__post_init__()
        plant: Any = self.plant
        needed, others = _NEEDED_OF_PLANTS.get(self.delay_from, (None, ""))
        if needed is not None and not _has(plant, needed):
            allowed = f"{type(plant).__name__} has no {needed} of its own"
            raise ArgumentError("evaluation.delay_from", self.delay_from, allowed, f"take {others}")
        for measure in self.measures:
            self._check(measure, plant)

    def _check(self, measure: Any, plant: StatePlant) -> None:
        name, unit = f"measures.{measure.name}", getattr(measure, "unit", DIMENSIONLESS)
        if plant.scales is None and unit != DIMENSIONLESS:
            raise ArgumentError(f"{name}.unit", unit, "needs a plant with units", f"take {DIMENSIONLESS}")
        guess = getattr(measure, "guess", None)
        if guess is not None and len(guess) != plant.n_states:
            states = ", ".join(plant.state_names)
            raise ArgumentError(f"{name}.guess", list(guess), f"must hold {plant.n_states} numbers, for {states}")

    def loop(self, design: Mapping[str, Floats | float]) -> ClosedLoop:
        """Return the closed loop from the first initial condition, with the law's own delay."""
        return self._loop(design, next(iter(self.initial_conditions.values())))

    @property
    def trajectory_samples(self) -> int:
        """How many times of a trajectory are stored."""
        return max(2001, 1 + int(SAMPLES_IN_PERIOD * self.horizon / (2.0 * np.pi)))

    @cached_property
    def delays(self) -> dict[str, float] | None:
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
        if self.delays is not None:
            table[DELAY] = np.repeat([self.delays[name] for name in names], b)
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

    def conclude(self, parts: Iterable[Mapping[str, Array]]) -> Conclusion:
        """Return sentences on where the largest multiplier is below 1, of surveys over one or two axes."""
        if LargestMultiplier.name not in self.row_columns:
            return Conclusion()
        names = ("initial_condition", *self.design_variables, LargestMultiplier.name)
        rows = joined([{name: part[name] for name in names} for part in parts])
        varied = [name for name in self.design_variables if np.unique(rows[name]).size > 2]
        if not 1 <= len(varied) <= 2:
            return Conclusion()
        first = max(varied, key=lambda name: np.unique(rows[name]).size)
        return Conclusion(notes=tuple(_stable_windows(rows, first, [name for name in varied if name != first])))

    def solve(  # type: ignore[override]
        self, design: Mapping[str, float], initial_condition: str, horizon: float | None = None
    ) -> StepwiseTrajectory:
        """Return the trajectory of one design point, over `horizon` or the evaluation's own."""
        state = self.initial_conditions[initial_condition]
        values: dict[str, Any] = dict(design)
        if self.delays is not None:
            values[DELAY] = self.delays[initial_condition]
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
        before = times - trajectory.delay(times)
        error = np.full(times.size, np.nan)
        late = before >= 0.0
        error[late] = np.linalg.norm(states[late] - trajectory(before[late]), axis=1)
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


def _stable_windows(rows: Mapping[str, Array], first: str, others: Sequence[str]) -> Iterator[str]:
    """Yield a sentence for every initial condition and value of another axis."""
    order = np.argsort(rows[first], kind="stable")
    groups = list(zip(rows["initial_condition"], *(rows[name] for name in others), strict=True))
    for group in dict.fromkeys(groups):
        places = [i for i in order if groups[i] == group]
        found = windows(rows[first][places], 1.0 - rows[LargestMultiplier.name][places])
        extent = " and ".join(f"{first} from {start:.3g} to {end:.3g}" for start, end in found) or f"no {first}"
        at = "".join(f", {name} = {value:g}" for name, value in zip(others, group[1:], strict=True))
        yield f"largest multiplier below 1 for {extent} ({group[0]}{at}; linear between points)"
