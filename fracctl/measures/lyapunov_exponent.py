"""The largest Lyapunov exponent of the free motion that a run begins with."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.measures.base import OfTrajectories
from fracctl.stability.lyapunov import largest_exponent
from fracctl.stepwise import StepwiseTrajectory


class LyapunovExponent(OfTrajectories):
    """The largest Lyapunov exponent of the plant without control, from the initial state of each run, per unit of time.

    `fracctl.stability.largest_exponent` over so many periods 2π after a transient; above 0 the motion is chaotic. It
    is a number of the plant and the start: with control and without it is the same.

    Args:
        periods: that count.
        transient_periods: before them, which do not.

    Raises:
        ArgumentError: there are no periods to count.
    """

    name = "lyapunov_exponent"
    columns = ("lyapunov_exponent",)

    def __init__(self, periods: float = 2000.0, transient_periods: float = 100.0) -> None:
        for name, value in (("periods", periods), ("transient_periods", transient_periods)):
            if not (np.isfinite(value) and value >= 0.0) or (name == "periods" and value == 0.0):
                raise ArgumentError(name, value, "must be a positive number")
        self.periods, self.transient_periods = float(periods), float(transient_periods)

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return column ``lyapunov_exponent``, (b,)."""
        starts = trajectory.steps(np.zeros((len(trajectory.end), 1)))[:, 0]
        different, place = np.unique(starts, axis=0, return_inverse=True)
        transient = 2.0 * np.pi * self.transient_periods
        horizon = transient + 2.0 * np.pi * self.periods
        exponents = np.atleast_1d(largest_exponent(trajectory.plant, different, horizon, transient))
        return {self.name: exponents[place.ravel()]}
