"""Gains that repeat themselves after a period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Floats
from fracctl.fractional.collocation import chebyshev_nodes


@dataclass(frozen=True)
class PeriodicGain:
    """K(t) of period T: the polynomial through its values at Chebyshev nodes of [0, T], continued periodically.

    It serves as the gain of `fracctl.controllers.DelayedFeedback` and of `fracctl.stability.multipliers`.
    """

    values: Floats
    """At `nodes`, (b, p, m, n)."""
    period: Floats
    """T, (b,)."""

    @property
    def nodes(self) -> Floats:
        """Times of the values, (b, p)."""
        return self.period[:, None] * chebyshev_nodes(self.values.shape[1]).t

    @property
    def average(self) -> Floats:
        """1/T ∫ K dt of that polynomial, (b, m, n), or (m, n) for a single one."""
        points, weights = np.polynomial.legendre.leggauss(self.values.shape[1])
        mean = np.einsum("k,bkmn->bmn", 0.5 * weights, self.at(np.tile(0.5 + 0.5 * points, (len(self.values), 1))))
        average: Floats = mean[0] if len(mean) == 1 else mean
        return average

    def at(self, phases: Floats) -> Floats:
        """Return the gains at shares of the period in [0, 1], (b, k) or (1, k), as (b, k, m, n)."""
        count, p, m, n = self.values.shape
        matrix = chebyshev_nodes(p).interpolation(phases.ravel()).reshape(*phases.shape, p)
        value: Floats = matrix @ self.values.reshape(count, p, m * n)
        return value.reshape(*value.shape[:2], m, n)

    def __call__(self, times: Floats) -> Floats:
        """Return the gains at times (b, k) or (1, k), (b, k, m, n)."""
        return self.at(times / self.period[:, None] % 1.0)
