"""Overshoot in metres."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.features import largest_excursion
from fracctl.measures.in_units import InUnits
from fracctl.trajectory import Trajectory


class OvershootM(InUnits):
    """The largest excursion past the equilibrium of any component, in metres.

    On the side opposite to the initial displacement, on either side where that is 0: what `Overshoot` by
    ``past_equilibrium`` takes the mean of.
    """

    name = "overshoot_m"
    columns = ("overshoot_m",)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the column, (b,)."""
        side = -np.sign(trajectory.initial_state[:, : trajectory.positions.shape[1]])
        largest = largest_excursion(trajectory.grid, trajectory.positions, side, with_end=True)
        return {self.name: self.scales.length_m * largest.max(axis=1)}
