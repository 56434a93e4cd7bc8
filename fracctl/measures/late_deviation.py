"""How far a tether's length still is from its target late in a run."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.measures.base import OfTrajectories
from fracctl.measures.tethers import tether_of, travel
from fracctl.meshwise import MeshTrajectory


class LateDeviation(OfTrajectories):
    """The largest |λ - λ_d| from a time on, at the times of the mesh; +inf where the member ended before the horizon.

    Args:
        after_orbits: from which f/2π on.

    Raises:
        ArgumentError: the time is negative.
    """

    name = "late_deviation"
    columns = ("late_deviation",)

    def __init__(self, after_orbits: float = 1.75) -> None:
        if not 0.0 <= after_orbits < np.inf:
            raise ArgumentError("after_orbits", after_orbits, "must not be negative")
        self.after_orbits = float(after_orbits)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return column ``late_deviation``, (b,); NaN where the horizon lies before that time.

        Raises:
            UnsupportedError: the plant is no tether.
        """
        tether_of(trajectory, self.name)
        target, _ = travel(trajectory)
        late = trajectory.times >= 2.0 * np.pi * self.after_orbits
        if not late.any():
            return {self.name: np.full(len(target), np.nan)}
        deviation = np.abs(trajectory.on_mesh[:, late, 0] - target[:, None]).max(axis=1)
        return {self.name: np.where(trajectory.end < trajectory.horizon, np.inf, deviation)}
