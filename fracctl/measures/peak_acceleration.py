"""Peak acceleration: the largest magnitude of the control, which a thruster must be able to give."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.features import largest_excursion
from fracctl.measures.base import OfTrajectories
from fracctl.trajectory import Trajectory


class PeakAcceleration(OfTrajectories):
    """max_i sup_{0 < s ≤ S} |υ_i(s)|, by component, as thrusters along the axes give it; υ(0+) counts.

    Times the acceleration scale r n² of the plant it is a thrust acceleration. Exact on the interpolant; +inf where
    there is no trajectory.
    """

    name = "peak_acceleration"
    columns = ("peak_acceleration",)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return column ``peak_acceleration``, (b,)."""
        controls = trajectory.controls_at_nodes
        within = largest_excursion(trajectory.grid, controls, np.zeros(controls.shape[:2]), with_end=True)
        begin = np.abs([trajectory.initial_controls, controls[:, :, 0]])
        return {self.name: np.fmax(begin.max(axis=0), within).max(axis=1)}


def peak_acceleration(trajectory: Trajectory) -> Floats | float:
    """Return the peak acceleration of each trajectory, (b,), or a number for a single one; see `PeakAcceleration`."""
    value = PeakAcceleration()(trajectory)["peak_acceleration"]
    return value if trajectory.batched else float(value[0])
