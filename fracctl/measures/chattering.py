"""How much the controls of a tether move once it is deployed."""

from __future__ import annotations

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.mesh_lines import begin_of, controls
from fracctl.measures.tethers import tether_of
from fracctl.meshwise import MeshTrajectory


class Chattering(OfTrajectories):
    """Total variation of each control from a while after the start to a member's end, in the units of the controls.

    A control that follows a smooth disturbance has some too: 4 amplitudes a period for a sine.

    Args:
        after_orbits: f/2π from which on it counts.

    Raises:
        ArgumentError: the number is negative.
    """

    name = "chattering"
    columns = ("chattering_length", "chattering_theta", "chattering_phi")

    def __init__(self, after_orbits: float = 0.5) -> None:
        self.begin = begin_of(after_orbits)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return columns ``chattering_length``, ``chattering_theta`` and ``chattering_phi``, (b,) each.

        Raises:
            UnsupportedError: the plant is no tether.
        """
        tether_of(trajectory, self.name)
        return dict(zip(self.columns, controls(trajectory, self.begin).variation().T, strict=True))
