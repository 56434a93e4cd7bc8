"""Overshoot: the largest excursion from the equilibrium after the start."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats, positive
from fracctl.errors import ArgumentError
from fracctl.features import largest_excursion
from fracctl.measures.base import OfTrajectories
from fracctl.measures.samples import samples_of
from fracctl.trajectory import Trajectory

DEFINITIONS = ("past_equilibrium", "largest_extremum")


class Overshoot(OfTrajectories):
    """σ = 1 + c x̂, the mean over the components (Yaylali, Butcher, Sinclair, section "Numerical survey").

    Args:
        definition: ``past_equilibrium``: x̂ is the largest excursion on the side opposite to the initial
            displacement, on either side where that is 0. ``largest_extremum``: x̂ is the largest extremum of |x|
            on either side, the initial position not counted.
        scale: c > 0.
        resolution: None for the exact extrema of the interpolant. A number takes the largest of the samples 0,
            resolution, 2 resolution, …; for ``largest_extremum`` of those that turn between their neighbours.

    Raises:
        ArgumentError: an unknown definition, or a scale or resolution that is not positive.
    """

    name = "overshoot"
    columns = ("overshoot",)

    def __init__(
        self, definition: str = "past_equilibrium", scale: float = 1e4, resolution: float | None = None
    ) -> None:
        if definition not in DEFINITIONS:
            raise ArgumentError("definition", repr(definition), f"must be one of {DEFINITIONS}")
        for name, value in (("scale", scale), ("resolution", resolution)):
            if value is not None:
                positive(name, value)
        self.definition, self.scale, self.resolution = definition, float(scale), resolution

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return column ``overshoot``, (b,)."""
        start = trajectory.initial_state[:, : trajectory.positions.shape[1]]
        past = self.definition == "past_equilibrium"
        side = -np.sign(start) if past else np.zeros_like(start)
        if self.resolution is None:
            largest = largest_excursion(trajectory.grid, trajectory.positions, side, with_end=past)
        else:
            largest = self._sampled(trajectory, start, side)
        return {self.name: 1.0 + self.scale * largest.mean(axis=1)}

    def _sampled(self, trajectory: Trajectory, start: Floats, side: Floats) -> Floats:
        """Return the largest samples, (b, m); +inf where there is no trajectory."""
        assert self.resolution is not None
        samples, past = samples_of(trajectory.grid, self.resolution), self.definition == "past_equilibrium"
        largest = np.empty_like(start)
        for i in range(start.shape[1]):
            values, initial = trajectory.positions[:, i], start[:, i]
            if past:
                largest[:, i] = samples.largest_excursion(values, initial, side[:, i])
            else:
                largest[:, i] = samples.largest_extremum(values, initial)
        return np.where(trajectory.missing[:, None], np.inf, largest)


def overshoot(
    trajectory: Trajectory, definition: str = "past_equilibrium", scale: float = 1e4, resolution: float | None = None
) -> Floats | float:
    """Return the overshoot of each trajectory, (b,), or a number for a single one; see `Overshoot`."""
    value = Overshoot(definition, scale, resolution)(trajectory)["overshoot"]
    return value if trajectory.batched else float(value[0])
