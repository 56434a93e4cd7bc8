"""The ideal law and what is left of it on board, side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats
from fracctl.errors import UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.measures import control_effort, settling_time
from fracctl.sampled.law import SampledLaw
from fracctl.sampled.margins import sampled_margins
from fracctl.sampled.measures import delta_v, settling_times
from fracctl.sampled.simulation import simulate
from fracctl.solvers import solve
from fracctl.stability.margins import Margins, margins
from fracctl.trajectory import Trajectory

IDEAL = "ideal"
_TOLERANCE = 1e-10
"""Of the ideal loop's solution."""


@dataclass(frozen=True)
class Implementation:
    """A row of the table; dimensionless but for names with a unit."""

    name: str
    """``ideal`` for the law itself."""
    settling_times: tuple[float, ...]
    """One for each δ; inf where the flight does not settle."""
    delta_v: float
    """∫ Σ_i |u_i| dt."""
    delta_v_m_s: float
    """The same in m/s; NaN for a plant without scales."""
    margins: Margins
    """Of the loop, sampled or not."""
    states: int | None
    """Number of states; None for the law itself, which remembers everything."""
    operations: int | None
    """Multiply-adds a step; None for the law itself."""
    control_deviation: float
    """Largest |u_k - υ(k T_s)| over the largest |υ(k T_s)| of the ideal law, each in its own flight."""


def compare(
    loop: ClosedLoop,
    implementations: Mapping[str, SampledLaw],
    initial_state: ArrayLike,
    horizon: float,
    thresholds: Sequence[float],
) -> list[Implementation]:
    """Return a row for the ideal loop and one for each implementation of its law, without noise and limits.

    Args:
        loop: single, of a linear plant and a linear law.
        implementations: sampled laws by name, of any law for this plant.
        initial_state: (n,).
        horizon: dimensionless.
        thresholds: δ, dimensionless.

    Raises:
        UnsupportedError: the loop is a batch, limited, or not linear.
    """
    if (loop.batch or 1) > 1 or loop.saturation is not None:
        raise UnsupportedError("the ideal loop of a comparison is a single one without limits")
    ideal = solve(loop, initial_state=initial_state, horizon=horizon, tolerance=_TOLERANCE)
    rows = [_ideal(loop, ideal, thresholds)]
    for name, law in implementations.items():
        controller = law.discrete(loop.plant.n_controls)
        flight = simulate(loop.plant, controller, initial_state, horizon)
        wanted = _controls(ideal, np.minimum(flight.times[:-1], ideal.horizon))
        spent = float(delta_v(flight))
        rows.append(
            Implementation(
                name,
                tuple(settling_times(flight, thresholds).ravel().tolist()),
                spent,
                spent * _speed(loop),
                sampled_margins(loop.plant, controller),
                controller.n_states,
                controller.operations,
                float(np.abs(flight.commands[0] - wanted).max() / np.abs(wanted).max()),
            )
        )
    return rows


def _ideal(loop: ClosedLoop, ideal: Trajectory, thresholds: Sequence[float]) -> Implementation:
    settled = tuple(_number(settling_time(ideal, threshold=delta)) for delta in thresholds)
    spent = _number(control_effort(ideal))
    return Implementation(IDEAL, settled, spent, spent * _speed(loop), margins(loop), None, None, 0.0)


def _controls(ideal: Trajectory, times: Floats) -> Floats:
    found = ideal.control(times)
    return found if found.ndim == 2 else found[0]


def _number(value: Floats | float) -> float:
    return float(np.ravel(value)[0])


def _speed(loop: ClosedLoop) -> float:
    return float("nan") if loop.plant.scales is None else loop.plant.scales.speed_m_s
