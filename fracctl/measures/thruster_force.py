"""What thrusters on the subsatellite of a tether must give."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.mesh_lines import begin_of, lines
from fracctl.measures.tethers import tether_of
from fracctl.meshwise import MeshTrajectory


class ThrusterForce(OfTrajectories):
    """The larger of |τ_θ|/(λ cos φ) and |τ_φ|/λ, at its largest up to a member's end.

    Over m̄ ḟ² L, and in newton. On a tether that is still short the torques of a law for the deployed one take a great
    force for a moment.

    Args:
        after_orbits: f/2π from which on it counts.

    Raises:
        ArgumentError: the number is negative.
    """

    name = "thruster_force"
    columns = ("thruster_force_max", "thruster_force_max_n")

    def __init__(self, after_orbits: float = 0.0) -> None:
        self.begin = begin_of(after_orbits)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return columns ``thruster_force_max`` and ``thruster_force_max_n``, (b,) each; 0 where a member ended before.

        Raises:
            UnsupportedError: the plant is no tether.
        """
        plant = tether_of(trajectory, self.name)
        x, u = trajectory.on_mesh, trajectory.controls_on_mesh
        arm = np.stack([x[..., 0] * np.cos(x[..., 2]), x[..., 0]], axis=-1)
        with np.errstate(all="ignore"):
            forces = (u[..., 1:] / arm, plant.thruster_force_n(trajectory.times, x, u))
        largest = [lines(trajectory, np.abs(force).max(axis=-1), self.begin).largest() for force in forces]
        return {name: np.maximum(value, 0.0) for name, value in zip(self.columns, largest, strict=True)}
