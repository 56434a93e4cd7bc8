"""The largest Floquet multiplier of a linear loop with memory."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.loop import ClosedLoop
from fracctl.measures.base import FLOQUET
from fracctl.stability import memory_multipliers


class FloquetMultiplier:
    """max |μ| over the isolated multipliers of a loop over the plant's period; below 1 it is asymptotically stable.

    Of a plant that is not linear those of its linearisation at 0, without limits of the control. See
    `fracctl.stability.memory_multipliers`; a loop takes some tenths of a second.

    Args:
        kernel_tolerance: relative error of the kernel.
    """

    name = FLOQUET
    columns = (FLOQUET,)

    def __init__(self, kernel_tolerance: float = 1e-4) -> None:
        self.kernel_tolerance = kernel_tolerance

    def of_loop(self, loop: ClosedLoop) -> dict[str, Floats]:
        """Return column ``floquet_multiplier``, (b,)."""
        members = range(loop.batch or 1)
        found = [memory_multipliers(loop, member=k, kernel_tolerance=self.kernel_tolerance).largest for k in members]
        return {FLOQUET: np.array(found)}
