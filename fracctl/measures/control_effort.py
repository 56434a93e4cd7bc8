"""Control effort: the integral of the magnitude of the control."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.features import absolute_integral
from fracctl.trajectory import Trajectory


class ControlEffort:
    """U = Σ_i ∫₀^S |υ_i| ds (Yaylali, Butcher, Sinclair, Eq. 24, to a finite horizon S).

    For α < 1 and an initial displacement the tail υ ~ s^(-α) makes U grow without bound with S: compare only values
    of one horizon. Times the speed scale of the plant it is a ΔV.
    """

    name = "control_effort"
    columns = ("control_effort",)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return column ``control_effort``, (b,)."""
        controls = trajectory.controls_at_nodes
        blank = np.isnan(controls.sum(axis=(1, 2)))
        clean = np.where(blank[:, None, None], 0.0, controls) if blank.any() else controls
        total = sum(absolute_integral(trajectory.grid, clean[:, i]) for i in range(controls.shape[1]))
        first = np.abs(clean[:, :, 0]).sum(axis=1) * trajectory.grid.panels[0].start
        effort: Floats = np.where(blank, np.inf, total + first)
        return {self.name: effort}


def control_effort(trajectory: Trajectory) -> Floats | float:
    """Return the control effort of each trajectory, (b,), or a number for a single one; see `ControlEffort`."""
    value = ControlEffort()(trajectory)["control_effort"]
    return value if trajectory.batched else float(value[0])
