"""How near to the equilibrium the last orbit is."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.in_units import InUnits, last_orbit
from fracctl.trajectory import Trajectory


class HoldError(InUnits):
    """Root mean square of the distance |ξ| over the last orbit before the horizon, in metres.

    Of a run that is shorter than an orbit over all of it. By Gauss's rule on 400 intervals.
    """

    name = "hold_error"
    columns = ("hold_error_m",)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the column, (b,)."""
        times, weights = last_orbit(trajectory.grid.horizon)
        square = (trajectory.grid.evaluate(trajectory.positions, times) ** 2).sum(axis=1) @ (weights / weights.sum())
        return {self.columns[0]: np.where(trajectory.missing, np.inf, self.scales.length_m * np.sqrt(square))}
