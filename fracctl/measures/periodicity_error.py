"""Periodicity error: how far a motion is from repeating itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.periods import SAMPLES, checked_period, differences, periods
from fracctl.stepwise import StepwiseTrajectory


class PeriodicityError(OfTrajectories):
    """max |x(t) - x(t - τ)| over the last period, t in [S - τ, S], with the Euclidean norm of the whole state.

    S is the horizon, or the end of a member that ended before. Dimensionless. The largest of 129 samples, which falls
    short of the maximum by less than 0.1 % for smooth orbits. +inf where a member ended within its first period.

    Args:
        period: τ, () or (b,); None for the delay of the control (of the plant for a free motion).

    Raises:
        ArgumentError: the period is not positive.
    """

    name = "periodicity_error"
    columns = ("periodicity_error",)

    def __init__(self, period: ArrayLike | None = None) -> None:
        self.period = checked_period(period)

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return column ``periodicity_error``, (b,).

        Raises:
            UnsupportedError: there is neither a period nor a delay.
        """
        period = periods(trajectory, self.period)
        first = np.maximum(trajectory.end - period, period)
        length = trajectory.end - first
        times = first[:, None] + np.maximum(length, 0.0)[:, None] * np.linspace(0.0, 1.0, SAMPLES + 1)
        largest = differences(trajectory, times, period).max(axis=1)
        return {self.name: np.where(length >= 0.0, largest, np.inf)}


def periodicity_error(trajectory: StepwiseTrajectory, period: ArrayLike | None = None) -> Floats | float:
    """Return the periodicity error of each trajectory, (b,), or a number for a single one; see `PeriodicityError`."""
    value = PeriodicityError(period)(trajectory)["periodicity_error"]
    return value if trajectory.batched else float(value[0])
