"""What a state is asked to follow: a step, an exponential approach, or a function of the user's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Booleans, Floats, finite
from fracctl.errors import ArgumentError


class Approach:
    """One component goes to a target, the others to 0.

        q_d1 = q_f + (q_s - q_f) e^(-ct),        c = 0 stands for the step q_d1 = q_f

    Args:
        target: q_f, () or (b,).
        start: q_s, () or (b,).
        rate: c ≥ 0, () or (b,).
        components: m.

    Raises:
        ArgumentError: a number is not finite, or c is negative.
    """

    def __init__(
        self, target: ArrayLike = 1.0, start: ArrayLike = 1.0, rate: ArrayLike = 0.0, components: int = 3
    ) -> None:
        self.target, self.start = finite("target", target), finite("start", start)
        self.rate, self.components = finite("rate", rate), components
        if (self.rate < 0.0).any():
            raise ArgumentError("rate", float(self.rate.min()), "must not be negative")

    def __call__(self, times: Floats) -> tuple[Floats, Floats]:
        """Return q_d and q_d' at times (t,), each (t, m) or (b, t, m)."""
        target, start, rate = (values[..., None] for values in np.broadcast_arrays(self.target, self.start, self.rate))
        moves: Booleans = rate > 0.0
        left = np.where(moves, (start - target) * np.exp(-rate * times), 0.0)
        value = np.zeros((*left.shape, self.components))
        slope = np.zeros_like(value)
        value[..., 0], slope[..., 0] = target + left, -rate * left
        return value, slope
