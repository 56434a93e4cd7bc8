"""From design points and settings of the solvers to rows with errors and costs."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fracctl.accuracy.findings import findings
from fracctl.accuracy.references import References
from fracctl.accuracy.settings import Setting, settings
from fracctl.arrays import Array, Floats, joined
from fracctl.evaluation import COUNTERS, Conclusion, Evaluation

SETTING = "setting"
"""Column that numbers the settings, an axis of the survey."""

_FEWEST = 8
_LONGEST_S = 0.25
"""A repeat has fewer members where all would take longer."""
_ROUNDING = 1e-12


@dataclass(frozen=True)
class AccuracyEvaluation(Evaluation):
    """Errors of the solvers' trajectories, and their CPU time, over the solvers' knobs; nothing is optimised.

    A row holds one solver at one `resolution` (N, or the tolerance of contour): `error` of the positions and
    `control_error` relative to the peaks, on uniform times, against a trajectory of another method; the solver's own
    `error_estimate`; and `seconds_per_trajectory`, the median CPU time of a batch of equal members over their number.
    `status` is ``failed`` where the estimate does not bound the errors.

    `seconds_per_trajectory` differs from run to run: keep it out of whatever is compared for equality.
    """

    contour: tuple[float, ...] = ()
    """Tolerances."""
    volterra: tuple[int, ...] = ()
    """Nodes on each panel."""
    collocation: tuple[int, ...] = ()
    """Degrees of the polynomial."""
    members: int = 256
    """Largest size of the batch that is timed."""
    repeats: int = 3
    """How often it is timed."""

    def __post_init__(self) -> None:
        """Ask for no objective."""

    @cached_property
    def settings(self) -> tuple[Setting, ...]:
        """All of them, in the order of their numbers."""
        knobs = {"contour": self.contour, "volterra": self.volterra, "collocation": self.collocation}
        return tuple(settings(knobs))

    @cached_property
    def axes(self) -> dict[str, Floats]:
        """The numbers of the settings, which every survey varies."""
        return {SETTING: np.arange(len(self.settings), dtype=np.float64)}

    @cached_property
    def row_columns(self) -> tuple[str, ...]:
        """Columns of the rows, in order."""
        found = ("error", "control_error", "error_estimate", "seconds_per_trajectory", "status", "stable")
        return ("initial_condition", *self.design_variables, SETTING, "solver", "resolution", *found, *COUNTERS)

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the rows of b points, each a design and a setting; initial conditions outermost.

        Raises:
            FracctlError: the references disagree.
        """
        full = self._full_design({name: values for name, values in design.items() if name != SETTING})
        numbers = np.asarray(design[SETTING], dtype=np.float64)
        full = {name: np.ascontiguousarray(np.broadcast_to(values, numbers.shape)) for name, values in full.items()}
        rows = []
        for name in self.initial_conditions:
            references: dict[tuple[float, ...], References] = {}
            for i, number in enumerate(numbers):
                point = {variable: float(values[i]) for variable, values in full.items()}
                key = tuple(point.values())
                if key not in references:
                    state = self.initial_conditions[name]
                    references[key] = References(self.loop(point), state, self.horizon)
                row = self._row(self.settings[int(number)], point, name, references[key])
                rows.append({"initial_condition": name, **point, SETTING: float(number), **row})
        return {name: _column([row[name] for row in rows]) for name in self.row_columns}

    def conclude(self, parts: Iterable[Mapping[str, Array]]) -> Conclusion:
        """Return what the rows say about the solvers."""
        orders = [name for name in self.design_variables if name.startswith("alpha_")]
        return Conclusion(notes=tuple(findings(joined(list(parts)), orders)))

    def _row(
        self, setting: Setting, point: Mapping[str, float], initial_condition: str, references: References
    ) -> dict[str, Any]:
        solver, state = setting.solver, self.initial_conditions[initial_condition]
        trajectory = solver.solve(self.loop(point), state, self.horizon)
        reference = references.independent_of(solver.name)
        error, control_error = reference.errors_of(references.samples(trajectory))
        estimate = float(trajectory.error_estimate[0])
        bounded = max(error, control_error) <= estimate + references.disagreement + _ROUNDING
        return {
            "solver": solver.name,
            "resolution": setting.resolution,
            "error": error,
            "control_error": control_error,
            "error_estimate": estimate,
            "seconds_per_trajectory": self._seconds(setting, point, state),
            "status": "ok" if bounded else "failed",
            "stable": trajectory.stable[0],
        } | {name: int(trajectory.counters[name][0]) for name in COUNTERS}

    def _seconds(self, setting: Setting, point: Mapping[str, float], state: Floats) -> float:
        """Return the CPU time of one trajectory among equal ones, the median of the repeats."""

        def timed(count: int) -> float:
            loop = self.loop({name: np.full(count, value) for name, value in point.items()})
            started = time.process_time()
            setting.solver.solve(loop, state, self.horizon)
            return (time.process_time() - started) / count

        fewest = min(_FEWEST, self.members)
        count = int(np.clip(_LONGEST_S / max(timed(fewest), 1e-9), fewest, self.members))
        return float(np.median([timed(count) for _ in range(self.repeats)]))


def _column(values: list[Any]) -> Array:
    words = any(value is None or isinstance(value, bool | np.bool_ | str) for value in values)
    return np.array(values, dtype=object if words else None)
