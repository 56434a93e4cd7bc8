"""Final distance: how far from the equilibrium a trajectory is at the horizon."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.trajectory import Trajectory


class FinalDistance(OfTrajectories):
    """max_i |ξ_i(S)| at the horizon S; tells trajectories that do not settle apart. +inf where there is none."""

    name = "final_distance"
    columns: tuple[str, ...] = ("final_distance",)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return column ``final_distance``, (b,)."""
        distance = np.abs(trajectory.positions[:, :, -1]).max(axis=1)
        return {self.name: np.where(trajectory.missing, np.inf, distance)}
