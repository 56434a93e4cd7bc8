"""Error against time per trajectory of the project's solvers, each over its own knob, on one batch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

import fracctl.solvers
from benchmarks import machine
from benchmarks.cases import Case, Truth, case, values
from benchmarks.peers.base import output_times
from benchmarks.timing import Task, take_turns
from fracctl.solvers import Solver
from fracctl.trajectory import Trajectory

SIZE = 1024
ROUNDS = 3
_CHECKED = 4
_KNOBS: dict[str, tuple[str, tuple[float, ...], dict[str, float]]] = {
    "Contour": ("tolerance", (1e-3, 1e-5, 1e-7, 1e-8, 1e-9, 1e-11), {}),
    "Volterra": ("nodes", (6, 8, 12, 16, 24, 32), {"tolerance": 1e-3}),
    "Collocation": ("nodes", (16, 32, 64, 128), {"tolerance": 0.9}),
}
"""Name of the knob, its values, and other options: tolerances so wide that no member is solved twice."""


@dataclass(frozen=True)
class Setting:
    """A solver with its knob at one value."""

    solver: Solver
    knob: str
    value: float

    @property
    def label(self) -> str:
        """Solver and knob in words."""
        return f"{self.solver.name}, {self.knob} = {self.value:g}"


def settings() -> Iterator[Setting]:
    """Yield the solvers that the package has, at all values of their knobs."""
    for name, (knob, knob_values, options) in _KNOBS.items():
        solver_class: Any = getattr(fracctl.solvers, name, None)
        if solver_class is not None:
            for value in knob_values:
                yield Setting(solver_class(**{knob: value}, **options), knob, value)


def measure() -> pd.DataFrame:
    """Time all settings in turn, in each plane."""
    return pd.concat([_one_plane(case(plane, SIZE)) for plane in ("out-of-plane", "in-plane")], ignore_index=True)


def _one_plane(batch: Case) -> pd.DataFrame:
    horizon = batch.evaluation.horizon
    loop = batch.evaluation.loop(batch.design)
    (state,) = batch.evaluation.initial_conditions.values()
    chosen = [setting for setting in settings() if setting.solver.supports(loop) is None]
    solved: dict[str, Trajectory] = {}

    def solve(setting: Setting) -> None:
        solved[setting.label] = setting.solver.solve(loop, state, horizon)

    tasks: dict[str, Task] = {setting.label: partial(solve, setting) for setting in chosen}
    timings = take_turns(tasks, dict.fromkeys(tasks, SIZE), ROUNDS)
    truth = Truth([batch.loop(member) for member in range(_CHECKED)], horizon)
    times = output_times(horizon)
    rows = []
    for setting in chosen:
        trajectory = solved[setting.label]
        errors = [truth.error(i, times, *values(trajectory, i, times)) for i in range(_CHECKED)]
        rows.append(
            {
                "plane": batch.plane,
                "solver": setting.solver.name,
                "knob": setting.knob,
                "value": setting.value,
                "error": max(errors),
                "estimate": float(np.max(trajectory.error_estimate[:_CHECKED])),
                "ms": 1e3 * timings[setting.label].seconds,
                "load": machine.load(),
            }
        )
    return pd.DataFrame(rows)
