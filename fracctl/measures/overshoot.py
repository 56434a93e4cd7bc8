"""Overshoot: the largest excursion from the equilibrium after the start."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.features import largest_excursion
from fracctl.trajectory import Trajectory

DEFINITIONS = ("past_equilibrium", "largest_extremum")


class Overshoot:
    """σ = 1 + c x̂, the mean over the components (Yaylali, Butcher, Sinclair, section "Numerical survey").

    Args:
        definition: ``past_equilibrium``: x̂ is the largest excursion on the side opposite to the initial
            displacement, on either side where that is 0. ``largest_extremum``: x̂ is the largest extremum of |x|
            on either side, the initial position not counted.
        scale: c > 0.

    Raises:
        ArgumentError: an unknown definition, or a scale that is not positive.
    """

    name = "overshoot"
    columns = ("overshoot",)

    def __init__(self, definition: str = "past_equilibrium", scale: float = 1e4) -> None:
        if definition not in DEFINITIONS:
            raise ArgumentError("definition", repr(definition), f"must be one of {DEFINITIONS}")
        if not (np.isfinite(scale) and scale > 0.0):
            raise ArgumentError("scale", scale, "must be positive")
        self.definition, self.scale = definition, float(scale)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return column ``overshoot``, (b,)."""
        m = trajectory.positions.shape[1]
        total = sum(self._component(trajectory, i) for i in range(m))
        overshoot = 1.0 + self.scale * total / m
        overshoot[np.isnan(trajectory.positions).any(axis=(1, 2))] = np.inf
        return {self.name: overshoot}

    def _component(self, trajectory: Trajectory, component: int) -> Floats:
        values, slopes = trajectory.positions[:, component], trajectory.slopes[:, component]
        past = self.definition == "past_equilibrium"
        side = -np.sign(trajectory.initial_state[:, component]) if past else np.zeros(len(values))
        return largest_excursion(trajectory.grid, values, slopes, side, with_end=past)


def overshoot(trajectory: Trajectory, definition: str = "past_equilibrium", scale: float = 1e4) -> Floats | float:
    """Return the overshoot of each trajectory, (b,), or a number for a single one; see `Overshoot`."""
    value = Overshoot(definition, scale)(trajectory)["overshoot"]
    return value if trajectory.batched else float(value[0])
