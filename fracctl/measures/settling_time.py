"""Settling time: when the position enters the band |ξ_i| ≤ δ for good."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Booleans, Floats, positive
from fracctl.features import last_crossing, value_at
from fracctl.measures.base import OfTrajectories
from fracctl.trajectory import Trajectory


class SettlingTime(OfTrajectories):
    """The last crossing of |ξ_i| = δ, the largest over the components; +inf if outside the band at the horizon.

    Args:
        threshold: δ > 0, dimensionless; 1e-5 is 100 m at a radius of 10⁴ km (Yaylali, Butcher, Sinclair).
        resolution: None for the exact crossing on the interpolant. A number takes the last of the samples
            0, resolution, 2 resolution, … with |ξ_i| > δ, as the paper's figures do with 0.01.

    Raises:
        ArgumentError: threshold or resolution is not positive.
    """

    name = "settling_time"
    columns = ("settling_time",)

    def __init__(self, threshold: float = 1e-5, resolution: float | None = None) -> None:
        for name, value in (("threshold", threshold), ("resolution", resolution)):
            if value is not None:
                positive(name, value)
        self.threshold, self.resolution = float(threshold), resolution

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return column ``settling_time``, (b,)."""
        exact: Floats = last_crossing(trajectory.grid, trajectory.positions, self.threshold).max(axis=1)
        if self.resolution is None:
            return {self.name: exact}
        return {self.name: self._sampled(trajectory, exact)}

    def _sampled(self, trajectory: Trajectory, exact: Floats) -> Floats:
        """Return the last sample outside the band; it lies at or before the exact crossing."""
        assert self.resolution is not None
        step = self.resolution
        number = np.floor(np.where(np.isfinite(exact), exact, 0.0) / step * (1.0 + 1e-14))
        pending = np.flatnonzero(np.isfinite(exact) & (number > 0))
        while pending.size:
            outside = self._outside(trajectory, pending, number[pending] * step)
            pending = pending[~outside]
            number[pending] -= 1.0
            pending = pending[number[pending] > 0]
        return np.where(np.isfinite(exact), number * step, np.inf)

    def _outside(self, trajectory: Trajectory, rows: Array, times: Floats) -> Booleans:
        positions = trajectory.positions[rows]
        components = range(positions.shape[1])
        magnitudes = [np.abs(value_at(trajectory.grid, positions[:, i], times)) for i in components]
        outside: Booleans = np.max(magnitudes, axis=0) > self.threshold
        return outside


def settling_time(trajectory: Trajectory, threshold: float = 1e-5, resolution: float | None = None) -> Floats | float:
    """Return the settling time of each trajectory, (b,), or a number for a single one; see `SettlingTime`."""
    value = SettlingTime(threshold, resolution)(trajectory)["settling_time"]
    return value if trajectory.batched else float(value[0])
