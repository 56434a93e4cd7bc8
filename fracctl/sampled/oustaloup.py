"""Fractional operators as Oustaloup's recursive filters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Complexes, Floats
from fracctl.errors import ArgumentError
from fracctl.sampled.operators import SampledOperator, lags


@dataclass(frozen=True)
class Oustaloup:
    """Poles and zeros, evenly in the logarithm over a band, instead of s^α.

        s^α ≈ ω_h^α Π_{k=1}^N (s + z_k)/(s + p_k),    z_k, p_k = ω_b (ω_h/ω_b)^((2k - 1 ∓ α)/(2N))

    (Oustaloup, Levron, Mathieu, Nanot, IEEE Trans. Circuits Syst. I 47 (2000) 25). The partial fractions are
    discretised exactly for signals that are linear between samples. That is not Tustin's rule and needs no prewarping:
    poles far above the Nyquist frequency do no harm. N states. Below the band the filter is a gain of ω_b^α, where a
    derivative has none.

    Args:
        lowest: ω_b, over the inverse unit of the period.
        highest: ω_h > ω_b.
        order: N ≥ 1.

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    lowest: float
    highest: float
    order: int

    def __post_init__(self) -> None:
        if not 0.0 < self.lowest < self.highest < math.inf:
            raise ArgumentError("lowest", self.lowest, f"must be positive and below `highest`, {self.highest:g}")
        if self.order < 1:
            raise ArgumentError("order", self.order, "must be at least 1")

    def zeros_and_poles(self, order: float) -> tuple[Floats, Floats]:
        """Return z_k and p_k of s^order, order in (-1, 1)."""
        ratio, k = self.highest / self.lowest, np.arange(1, self.order + 1)
        zeros, poles = (self.lowest * ratio ** ((2.0 * k - 1.0 + sign * order) / (2 * self.order)) for sign in (-1, 1))
        return zeros, poles

    def response(self, order: float, omega: Floats) -> Complexes:
        """Return the continuous filter for s^order at s = iω, (k,)."""
        zeros, poles = self.zeros_and_poles(order)
        s = 1j * np.asarray(omega)[:, None]
        value: Complexes = self.highest**order * np.prod((s + zeros) / (s + poles), axis=1)
        return value

    def derivative(self, order: float, period: float) -> SampledOperator:
        """Return D^order of a signal less its first sample, order in (0, 1).

        The memory of a constant is at rest, with the filter's own ω_b^α times the constant as output.
        """
        operator = self._sampled(order, period)
        rest = operator.b / (1.0 - operator.a.diagonal())
        return SampledOperator(operator.a, operator.b, operator.c, operator.f, rest)

    def integral(self, order: float, period: float) -> SampledOperator:
        """Return I^order of a signal from the first sample, order in (0, 1)."""
        return self._sampled(-order, period)

    def _sampled(self, order: float, period: float) -> SampledOperator:
        zeros, poles = self.zeros_and_poles(order)
        gain = self.highest**order
        differences = poles - poles[:, None] + np.eye(self.order)
        residues = gain * np.prod(zeros - poles[:, None], axis=1) / np.prod(differences, axis=1)
        return lags(poles, residues, gain, period)
