"""Fractional operators whose power-law memory is a sum of exponentials."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fracctl.errors import ArgumentError
from fracctl.fractional.sum_of_exponentials import SumOfExponentials, sum_of_exponentials
from fracctl.sampled.operators import SampledOperator, first_order_hold


@dataclass(frozen=True)
class Exponentials:
    """Modes that decay at fixed rates, for signals that are linear between samples.

        I^p y(t_n) = ∫_0^h τ^(p-1)/Γ(p) y(t_n-τ) dτ + Σ_j w_j e^{-s_j h} φ_j(t_{n-1}),    φ_j' = -s_j φ_j + y

    and D^α y = I^(1-α) y' with the slopes of the lines. The last period is exact; before, the kernel is that of
    `fracctl.fractional.sum_of_exponentials`, right up to `longest` back, beyond which it fades. As many states as
    modes, and one for the sample before.

    Args:
        longest: time that is remembered, in the unit of the period; not below it.
        tolerance: largest relative error of the kernel, in [1e-13, 0.1].

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    longest: float
    tolerance: float = 1e-3

    def __post_init__(self) -> None:
        if not (math.isfinite(self.longest) and self.longest > 0.0):
            raise ArgumentError("longest", self.longest, "must be positive")

    def modes(self, order: float, period: float) -> SumOfExponentials:
        """Return rates and weights for I^order."""
        return sum_of_exponentials(order, period, max(self.longest, period), self.tolerance)

    def derivative(self, order: float, period: float) -> SampledOperator:
        """Return D^order of a signal, order in (0, 1), Caputo from the first sample."""
        found = self.modes(1.0 - order, period)
        decay, share = np.exp(-found.rates * period), -np.expm1(-found.rates * period) / (found.rates * period)
        local = period**-order / math.gamma(2.0 - order)
        a = np.zeros((1 + len(share), 1 + len(share)))
        a[1:, 0] = -share
        a[1:, 1:] = np.diag(decay)
        first = np.concatenate([[1.0], np.zeros(len(share))])
        c = np.concatenate([[-local], found.weights * decay])
        # the modes take up the last slope with the next sample, so the present ones still lack it
        return SampledOperator(csr_array(a), np.concatenate([[1.0], share]), c, local, first)

    def integral(self, order: float, period: float) -> SampledOperator:
        """Return I^order of a signal, order in (0, 1), from the first sample."""
        found = self.modes(order, period)
        decay, earlier, present = first_order_hold(found.rates, period)
        whole, slope = period**order / math.gamma(order + 1.0), order * period**order / math.gamma(order + 2.0)
        before, now = slope - float(found.weights @ earlier), whole - slope
        a = np.zeros((1 + len(decay), 1 + len(decay)))
        a[1:, 1:] = np.diag(decay)
        b = np.concatenate([[1.0], earlier + decay * present])
        e = np.concatenate([[(float(found.weights @ present) - now) / before], -present])
        return SampledOperator(csr_array(a), b, np.concatenate([[before], found.weights]), now, e)
