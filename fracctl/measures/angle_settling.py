"""Settling and overshoot of the two angles of a tether."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats, positive
from fracctl.measures.base import OfTrajectories
from fracctl.measures.mesh_cubics import cubics
from fracctl.measures.tethers import targets, tether_of
from fracctl.meshwise import MeshTrajectory


class AngleSettling(OfTrajectories):
    """When the in-plane and out-of-plane angles come within a threshold of their targets for good, and how far past.

    Settling is f/2π of the last crossing, +inf where an angle is outside at the horizon or the member ended before.
    The overshoot, in radians, is the largest excursion to the side opposite to the start, to either side where that is
    the target, up to a member's end; the largest angle is that of the whole run. All on the cubics of the mesh.

    Args:
        threshold: in radians; 0.002 is 2 % of the angles that the deployments of Zhong et al. begin with.

    Raises:
        ArgumentError: the threshold is not positive.
    """

    name = "angle_settling"
    columns = (
        *("theta_settling_orbits", "phi_settling_orbits", "theta_overshoot_rad", "phi_overshoot_rad"),
        *("theta_largest_rad", "phi_largest_rad"),
    )

    def __init__(self, threshold: float = 0.002) -> None:
        self.threshold = positive("threshold", threshold)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return settling, overshoot and largest excursion of both angles, (b,) each.

        Raises:
            UnsupportedError: the plant is no tether.
        """
        tether_of(trajectory, self.name)
        centre = targets(trajectory)
        settled, past, largest = [], [], []
        for angle in (1, 2):
            distance = cubics(trajectory, angle, centre[:, angle])
            settled.append(distance.last_crossing(np.full(len(centre), self.threshold)) / (2.0 * np.pi))
            past.append(distance.largest(-np.sign(trajectory.on_mesh[:, 0, angle] - centre[:, angle])))
            largest.append(distance.largest(np.zeros(len(centre))))
        return dict(zip(self.columns, [*settled, *past, *largest], strict=True))
