"""Periods of trajectories of delayed feedback, and how far states are from those of one period before."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.plants.capabilities import period_of
from fracctl.plants.state import SecondOrder
from fracctl.stepwise import StepwiseTrajectory

SAMPLES = 128
"""Times in a period at which a state is compared with another; the largest of them falls short by 0.03 % of the
largest where the difference is one wave a period, by (j π/128)²/2 of it where it is j waves."""


def checked_period(period: ArrayLike | None) -> Floats | None:
    """Return a period that is given, () or (b,); raise ArgumentError unless it is positive."""
    if period is None:
        return None
    value = finite("period", period)
    if value.ndim > 1 or not (value > 0.0).all():
        raise ArgumentError("period", value.tolist(), "must be positive, of shape () or (b,)")
    return value


def periods(trajectory: StepwiseTrajectory, period: Floats | None) -> Floats:
    """Return the period of each member, (b,): as given, else the (last) delay of the control, else the plant's.

    Raises:
        UnsupportedError: there is none of the three.
        ArgumentError: the batch has another size.
    """
    batch = len(trajectory.end)
    if period is None:
        period = _last_delay(trajectory) if trajectory.terms else plant_period(trajectory)
    if period is None:
        raise UnsupportedError("a free motion has no delay to take the period from; give `period`")
    if period.ndim == 1 and len(period) not in (1, batch):
        raise ArgumentError("period", f"of shape {period.shape}", f"must have shape () or ({batch},)")
    return np.array(np.broadcast_to(period, (batch,)))


def _last_delay(trajectory: StepwiseTrajectory) -> Floats:
    first, adapted = trajectory.terms[0].delay, trajectory.steps.delay
    if adapted is None:
        return first
    last = adapted(trajectory.end[:, None])[:, 0, 0]
    return np.where(np.isfinite(last), last, first)


def plant_period(trajectory: StepwiseTrajectory) -> Floats | None:
    """Return the period of the plant, or of its leader's orbit, (); None where it has none."""
    period = period_of(trajectory.plant)
    return None if period is None else np.array(period)


def n_positions(trajectory: StepwiseTrajectory) -> int:
    """Return the number of states that are positions: the first half, or all where the plant does not tell."""
    plant = trajectory.plant
    return len(plant.components) if isinstance(plant, SecondOrder) else plant.n_states


def differences(trajectory: StepwiseTrajectory, times: Floats, period: Floats, states: int | None = None) -> Floats:
    """Return |x(t) - x(t - T)| of the first states at times (b, k), (b, k), +inf where one is not finite."""
    gap = trajectory.steps(times) - trajectory.steps(np.maximum(times - period[:, None], 0.0))
    size = np.linalg.norm(gap[..., :states], axis=2)
    return np.where(np.isfinite(size), size, np.inf)
