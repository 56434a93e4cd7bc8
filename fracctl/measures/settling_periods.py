"""Settling of delayed feedback, counted in periods."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, positive
from fracctl.measures.base import OfTrajectories
from fracctl.measures.periods import SAMPLES, checked_period, differences, periods
from fracctl.stepwise import StepwiseTrajectory


class SettlingPeriods(OfTrajectories):
    """The first whole number k for which |x(t) - x(t - τ)| stays below a threshold for all t ≥ k τ.

    128 samples a period; at least 1, for there is nothing to compare the first period with. +inf where the last period
    is still above the threshold, or the member ended before the horizon.

    Args:
        threshold: of the Euclidean norm of the difference, dimensionless.
        period: τ, () or (b,); None for the delay of the control (of the plant for a free motion).

    Raises:
        ArgumentError: a number is not positive.
    """

    name = "settling_periods"
    columns = ("settling_periods",)

    def __init__(self, threshold: float = 1e-6, period: ArrayLike | None = None) -> None:
        self.threshold, self.period = positive("threshold", threshold), checked_period(period)

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return column ``settling_periods``, (b,).

        Raises:
            UnsupportedError: there is neither a period nor a delay.
        """
        period = periods(trajectory, self.period)
        last = trajectory.end / period
        settled = np.where(last > 1.0, 1.0, np.inf)
        for k in range(1, int(np.ceil(last.max()))):
            parts = np.minimum(k + np.arange(SAMPLES + 1) / SAMPLES, np.maximum(last, 1.0)[:, None])
            above = differences(trajectory, parts * period[:, None], period).max(axis=1) >= self.threshold
            settled = np.where(above & (last > k), np.where(last > k + 1, k + 1.0, np.inf), settled)
        return {self.name: np.where(trajectory.end < trajectory.horizon, np.inf, settled)}


def settling_periods(
    trajectory: StepwiseTrajectory, threshold: float = 1e-6, period: ArrayLike | None = None
) -> Floats | float:
    """Return the settling of each trajectory in periods, (b,), or a number for a single one; see `SettlingPeriods`."""
    value = SettlingPeriods(threshold, period)(trajectory)["settling_periods"]
    return value if trajectory.batched else float(value[0])
