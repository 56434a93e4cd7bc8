"""The delay at the end of a run, which differs from the first one where the delay adapts."""

from __future__ import annotations

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.periods import periods
from fracctl.stepwise import StepwiseTrajectory


class FinalDelay(OfTrajectories):
    """τ at the end of each run."""

    name = "final_delay"
    columns = ("final_delay",)

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return column ``final_delay``, (b,)."""
        return {self.name: periods(trajectory, None)}
