"""Where the gains of an adaptive sliding mode have gone."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.meshwise import MeshTrajectory


class FinalGains(OfTrajectories):
    """ϑ₁ and ϑ₂ at a member's end; NaN for laws that do not adapt."""

    name = "final_gains"
    columns = ("vartheta_1", "vartheta_2")

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return columns ``vartheta_1`` and ``vartheta_2``, (b,) each."""
        batch, adapted = len(trajectory.end), getattr(trajectory.law, "adapted", None)
        if adapted is None:
            return {name: np.full(batch, np.nan) for name in self.columns}
        last = np.searchsorted(trajectory.times, trajectory.end, side="right") - 1
        gains = adapted(trajectory.auxiliary[np.arange(batch), last])
        return dict(zip(self.columns, gains.T, strict=True))
