"""Fractional operators that remember a number of samples: Grünwald and Letnikov's weights on a shift register."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, eye_array

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.sampled.operators import SampledOperator

MOST_SAMPLES = 20_000
"""Of a window: every step moves all of them, on three axes of every flight."""


@dataclass(frozen=True)
class Window:
    """The "short memory" of Podlubny, Fractional Differential Equations (1999), section 7.3.

        D^α y(t_n) ≈ h^(-α) Σ_{k=0}^{M-1} g_k (y_{n-k} - y_{n-M+1}),        g_k = (-1)^k C(α, k)

    is Caputo's derivative from the oldest sample in the window on: until the window is full from the first sample, then
    from a terminal that moves along, M - 1 periods back. I^p is the same with order -p and nothing subtracted. M - 1
    states and M multiply-adds; the error is O(h).

    Args:
        samples: M, the present one included; 2 to `MOST_SAMPLES`.

    Raises:
        ArgumentError: there are fewer samples, or more.
    """

    samples: int

    def __post_init__(self) -> None:
        if self.samples < 2:
            raise ArgumentError("samples", self.samples, "must be at least 2")
        if self.samples > MOST_SAMPLES:
            cure = "sum of exponentials or a filter of Oustaloup's"
            raise ArgumentError(
                "samples", self.samples, f"must be at most {MOST_SAMPLES}", f"a longer memory is a {cure}"
            )

    def derivative(self, order: float, period: float) -> SampledOperator:
        """Return D^order of a signal, order in (0, 1], Caputo from the oldest sample."""
        weights = grunwald_letnikov_weights(order, self.samples) * period**-order
        weights[-1] -= weights.sum()
        return _register(weights, np.ones(self.samples - 1))

    def integral(self, order: float, period: float) -> SampledOperator:
        """Return I^order of a signal, order in (0, 1], over the window."""
        return _register(grunwald_letnikov_weights(-order, self.samples) * period**order, np.zeros(self.samples - 1))


def grunwald_letnikov_weights(order: float, count: int) -> Floats:
    """Return g_k = (-1)^k C(order, k) for k < count; order < 0 for an integral."""
    k = np.arange(1, count)
    return np.concatenate([[1.0], np.cumprod(1.0 - (order + 1.0) / k)])


def _register(weights: Floats, first: Floats) -> SampledOperator:
    """Return Σ_k w_k y_{n-k}, the states y_{n-1}, y_{n-2}, …."""
    length = len(weights) - 1
    newest = np.concatenate([[1.0], np.zeros(length - 1)])
    register = csr_array(eye_array(length, k=-1))
    return SampledOperator(register, newest, weights[1:], float(weights[0]), first)
