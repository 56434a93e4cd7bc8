"""What the controls of a tether add up to."""

from __future__ import annotations

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.mesh_lines import controls
from fracctl.measures.tethers import tether_of
from fracctl.meshwise import MeshTrajectory


class ActuationEffort(OfTrajectories):
    """∫ |τ| df of each control up to a member's end: of the tension's control over m̄ ḟ² L, of the torques over m̄ ḟ² L².

    Controls are straight lines between the times of the mesh.
    """

    name = "actuation_effort"
    columns = ("effort_length", "effort_theta", "effort_phi")

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return columns ``effort_length``, ``effort_theta`` and ``effort_phi``, (b,) each.

        Raises:
            UnsupportedError: the plant is no tether.
        """
        tether_of(trajectory, self.name)
        return dict(zip(self.columns, controls(trajectory).absolute_integral().T, strict=True))
