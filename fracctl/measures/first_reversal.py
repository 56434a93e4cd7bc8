"""When a tether first moves away from its target."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.tethers import tether_of, travel
from fracctl.meshwise import MeshTrajectory


class FirstReversal(OfTrajectories):
    """The first f/2π at which the rate of the length turns against its way: λ' < 0 in a deployment.

    Between the times of the mesh rates are straight lines. +inf where the rate never turns before the member's end,
    and for station-keeping, which has no way to go.
    """

    name = "first_reversal"
    columns = ("first_reversal_orbits",)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return column ``first_reversal_orbits``, (b,).

        Raises:
            UnsupportedError: the plant is no tether.
        """
        tether_of(trajectory, self.name)
        _, way = travel(trajectory)
        rate = np.sign(way)[:, None] * trajectory.on_mesh[..., trajectory.demands.shape[2]]
        member, k = np.arange(len(rate)), np.argmax(rate < 0.0, axis=1)
        turns, before = rate[member, k] < 0.0, np.maximum(k - 1, 0)
        high, low = rate[member, before], rate[member, k]
        share = np.where(k > 0, high / np.where(high > low, high - low, 1.0), 0.0)
        at = trajectory.times[before] + share * (trajectory.times[k] - trajectory.times[before])
        return {self.columns[0]: np.where(turns & (at <= trajectory.end), at, np.inf) / (2.0 * np.pi)}
