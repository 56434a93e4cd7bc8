"""Boundedness: how far a motion is from the origin in the end, and whether it got there."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.measures.base import OfTrajectories
from fracctl.measures.periods import SAMPLES, n_positions
from fracctl.stepwise import StepwiseTrajectory


class Boundedness(OfTrajectories):
    """The largest |ξ| over the last part of a run, and whether the run reached its horizon.

    ``bounded`` is 1 where no terminal event ended the member and it did not diverge, 0 otherwise (why is its status);
    it says nothing about stability. ``largest_distance`` is dimensionless, over the last part of what was flown, from
    about 1000 samples; the positions are the first half of the state (the whole state of plants that are no
    `SecondOrder`).

    Args:
        part: the last share of the run, in (0, 1].

    Raises:
        ArgumentError: the part lies outside its range.
    """

    name = "boundedness"
    columns = ("largest_distance", "bounded")

    def __init__(self, part: float = 0.25) -> None:
        if not 0.0 < part <= 1.0:
            raise ArgumentError("part", part, "must lie in (0, 1]")
        self.part = float(part)

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return columns ``largest_distance`` and ``bounded``, (b,)."""
        shares = 1.0 - self.part * np.linspace(0.0, 1.0, 8 * SAMPLES + 1)
        positions = trajectory.steps(trajectory.end[:, None] * shares)[..., : n_positions(trajectory)]
        distance = np.linalg.norm(positions, axis=2)
        largest = np.where(np.isfinite(distance), distance, np.inf).max(axis=1)
        return {"largest_distance": largest, "bounded": (trajectory.end >= trajectory.horizon).astype(np.float64)}


def largest_distance(trajectory: StepwiseTrajectory, part: float = 0.25) -> Floats | float:
    """Return the largest distance over the last part of each trajectory, (b,), or a number; see `Boundedness`."""
    value = Boundedness(part)(trajectory)["largest_distance"]
    return value if trajectory.batched else float(value[0])
