"""Fractional integrals with a memory of fixed length: the power-law kernel as a sum of exponentials."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import loggamma, rgamma

from fracctl.arrays import Floats, finite
from fracctl.errors import ArgumentError

_SHARES = 3
"""The tolerance is spent on the spacing, on the slow and on the fast rates that are left out."""


@dataclass(frozen=True)
class SumOfExponentials:
    """Rates and weights with t^(p-1)/Γ(p) ≈ Σ_j w_j exp(-s_j t) for shortest ≤ t ≤ longest.

    A fractional integral is then what J filters φ_j' = -s_j φ_j + g, φ_j(0) = 0, have kept of g:

        I^p g(t) = 1/Γ(p) ∫_0^t (t-τ)^(p-1) g(τ) dτ ≈ Σ_j w_j φ_j(t)

    but for the last `shortest` of time before t, where the kernel is integrated exactly. The Caputo derivative of order
    ν in (0, 1) of y is I^(1-ν) y'; the Riemann-Liouville derivative from time 0 is the same with φ_j(0) = y(0).
    """

    order: Floats
    """p, () or (b,)."""
    rates: Floats
    """s_j, (J,), growing; the same for all orders."""
    weights: Floats
    """w_j, (J,) or (b, J)."""
    error_bound: Floats
    """Bound on the relative error of the kernel from `shortest` to `longest`, shaped as `order`."""

    def kernel(self, times: ArrayLike) -> Floats:
        """Return Σ_j w_j exp(-s_j t) at times (t,), (t,) or (b, t)."""
        decay = np.exp(-np.multiply.outer(self.rates, finite("times", times)))
        value: Floats = self.weights @ decay
        return value


def sum_of_exponentials(
    order: ArrayLike, shortest: float, longest: float, tolerance: float = 1e-8
) -> SumOfExponentials:
    """Return a sum of exponentials for the kernel of I^p, with few rates that serve all orders given.

        t^(p-1)/Γ(p) = sin(πp)/π ∫ exp(μx - t e^x) dx,    μ = 1 - p

    by the trapezoidal rule with spacing h in x. Its relative error is 2 Σ_k |Γ(μ + 2πik/h)|/Γ(μ) at most, whatever t
    (the Fourier transform of the integrand). Rates too slow to tell apart up to `longest` are joined into one with
    their mean rate; rates too fast to be seen from `shortest` on are left out.

    Args:
        order: p in (0, 1), () or (b,).
        shortest: time from which on the sum is used, positive.
        longest: time up to which it is used, not below `shortest`.
        tolerance: largest relative error, in [1e-13, 0.1].

    Raises:
        ArgumentError: an argument lies outside its range.
    """
    p = finite("order", order)
    if p.ndim > 1 or not ((p > 0.0) & (p < 1.0)).all():
        raise ArgumentError("order", p.tolist(), "must lie in (0, 1), with shape () or (b,)")
    if not 0.0 < shortest <= longest < np.inf:
        raise ArgumentError("shortest", shortest, f"must be positive and not above `longest`, {longest:g}")
    if not 1e-13 <= tolerance <= 0.1:
        raise ArgumentError("tolerance", tolerance, "must lie in [1e-13, 0.1]")
    exponent = 1.0 - p
    spacing = _spacing(tuple(np.atleast_1d(exponent).tolist()), tolerance / _SHARES)
    rates, weights, joined = _rule(np.atleast_1d(exponent)[:, None], spacing, shortest, longest, tolerance / _SHARES)
    bound = _trapezoidal_error(np.atleast_1d(exponent), spacing) + joined + tolerance / _SHARES
    return SumOfExponentials(p, rates, weights.reshape(*p.shape, len(rates)), bound.reshape(p.shape))


def _trapezoidal_error(exponent: Floats, spacing: float) -> Floats:
    """Return 2 Σ_k |Γ(μ + 2πik/h)|/Γ(μ), (b,)."""
    k = np.arange(1, 1 + int(np.ceil(4.0 * spacing)) + 4)
    terms = np.exp(loggamma(exponent[:, None] + 2j * np.pi * k / spacing).real - loggamma(exponent[:, None]).real)
    total: Floats = 2.0 * terms.sum(axis=1)
    return total


@lru_cache(maxsize=256)
def _spacing(exponents: tuple[float, ...], tolerance: float) -> float:
    """Return the largest h in steps of 1 % that keeps the tolerance."""
    spacing, values = 3.0, np.unique(exponents)
    while _trapezoidal_error(values, spacing).max() > tolerance:
        spacing *= 0.99
    return spacing


def _rule(
    exponent: Floats, spacing: float, shortest: float, longest: float, tolerance: float
) -> tuple[Floats, Floats, Floats]:
    """Return rates (J,), weights (b, J), and a bound on what joining slow rates changes, (b,)."""
    fastest = np.log((np.log(1.0 / tolerance) + 3.0) / shortest)
    slow = _slowest(exponent, spacing, longest, tolerance)
    x = slow + spacing * np.arange(1 + int(np.ceil((fastest - slow) / spacing)))
    unit = spacing * np.sin(np.pi * exponent) / np.pi
    total = unit * np.exp(exponent * x[0]) / np.expm1(exponent * spacing)
    moment = unit * np.exp((exponent + 1.0) * x[0]) / np.expm1((exponent + 1.0) * spacing)
    mean = float((moment / total).min())
    weights = np.concatenate([total, unit * np.exp(exponent * x)], axis=1)
    return np.concatenate([[mean], np.exp(x)]), weights, _joining_error(exponent, spacing, x[0], longest, mean)


def _slowest(exponent: Floats, spacing: float, longest: float, tolerance: float) -> float:
    """Return the first x whose predecessors may be joined."""
    x = np.log(1.0 / longest)
    while True:
        rates = np.exp((exponent + 1.0) * x) / np.expm1((exponent + 1.0) * spacing)
        mean = float((rates * np.expm1(exponent * spacing) / np.exp(exponent * x)).min())
        if _joining_error(exponent, spacing, x, longest, mean).max() <= tolerance:
            return float(x)
        x -= spacing


def _joining_error(exponent: Floats, spacing: float, x: float, longest: float, mean: float) -> Floats:
    """Bound the relative error of one rate for all below x, (b,).

    |e^(-st) - e^(-ct)| ≤ for the part linear in s - c what is left of it where c is not the mean of this order, and
    for the rest t² (s² + c²)/2.
    """
    unit = spacing * rgamma(exponent)[:, 0] * longest ** exponent[:, 0]
    powers = [np.exp((exponent[:, 0] + k) * x) / np.expm1((exponent[:, 0] + k) * spacing) for k in range(3)]
    linear = np.abs(powers[1] - mean * powers[0]) * longest
    square = 0.5 * longest**2 * (powers[2] + mean**2 * powers[0])
    error: Floats = unit * (linear + square)
    return error
