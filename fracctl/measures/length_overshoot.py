"""Overshoot of a tether's length past its target."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.mesh_cubics import cubics
from fracctl.measures.tethers import tether_of, travel
from fracctl.meshwise import MeshTrajectory


class LengthOvershoot(OfTrajectories):
    """The largest excursion of the length past its target, in percent of the way there; 0 if there is none.

    The target is what the reference goes to in the end. For station-keeping, which starts at the target, the largest
    excursion to either side in percent of the target. Found on the cubics between the times of the mesh, up to a
    member's end.
    """

    name = "length_overshoot"
    columns = ("overshoot_percent",)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return column ``overshoot_percent``, (b,).

        Raises:
            UnsupportedError: the plant is no tether.
        """
        tether_of(trajectory, self.name)
        target, way = travel(trajectory)
        span = np.where(way == 0.0, np.abs(target), np.abs(way))
        return {"overshoot_percent": 100.0 * cubics(trajectory, 0, target).largest(np.sign(way)) / span}


def length_overshoot(trajectory: MeshTrajectory) -> Floats | float:
    """Return the overshoot in percent, (b,), or a number for a single trajectory; see `LengthOvershoot`."""
    value = LengthOvershoot()(trajectory)["overshoot_percent"]
    return value if trajectory.batched else float(value[0])
