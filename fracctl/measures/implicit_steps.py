"""How the equations of implicit steps were solved."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.meshwise import MeshTrajectory


class ImplicitSteps(OfTrajectories):
    """How many steps Newton's method did not solve: by bracketing instead, and not at all."""

    name = "implicit_steps"
    columns = ("newton_fallbacks", "unresolved_steps")

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return columns ``newton_fallbacks`` and ``unresolved_steps``, (b,) each."""
        counts = (trajectory.counters["bracketed"], trajectory.counters["unresolved"])
        return {name: np.asarray(value, np.float64) for name, value in zip(self.columns, counts, strict=True)}
