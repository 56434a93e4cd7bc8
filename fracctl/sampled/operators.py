"""Fractional derivatives and integrals of sampled signals as discrete state spaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, diags_array

from fracctl.arrays import Complexes, Floats

Sparse = csr_array
"""A matrix by its rows, without zeros: a register of thousands of samples is nothing but zeros beside its ones."""


@dataclass(frozen=True)
class SampledOperator:
    """An operator on one signal y, sampled with period h.

        x_{k+1} = A x_k + b y_k,        d_k = c·x_k + f y_k,        x_0 = e y_0

    x_0 is the state of a memory that begins with the first sample: D of a constant is 0 then, as of Caputo's derivative
    from there on, and an integral is 0.
    """

    a: Sparse
    """A, (n, n), lower triangular."""
    b: Floats
    """b, (n,)."""
    c: Floats
    """c, (n,)."""
    f: float
    """f, the share of the present sample."""
    e: Floats
    """e, (n,)."""

    def __call__(self, signal: ArrayLike) -> Floats:
        """Return d_k for samples y_k, (k,), from the first on."""
        y = np.asarray(signal, dtype=np.float64)
        state, out = self.e * y[0], np.empty_like(y)
        for k, sample in enumerate(y):
            out[k] = self.c @ state + self.f * sample
            state = self.a @ state + self.b * sample
        return out

    def response(self, phase: Floats) -> Complexes:
        """Return f + c·(z I - A)⁻¹ b at z = exp(i phase), phase (k,), (k,)."""
        x = substituted(self.a, self.b[:, None], np.exp(1j * phase))
        value: Complexes = self.f + np.einsum("i,kij->k", self.c, x)
        return value


class Memory(Protocol):
    """How an operator of fractional order is implemented with a memory of fixed length."""

    def derivative(self, order: float, period: float) -> SampledOperator:
        """Return D^order of a signal, order in (0, 1), Caputo from the first sample."""
        ...

    def integral(self, order: float, period: float) -> SampledOperator:
        """Return I^order of a signal, order in (0, 1), from the first sample."""
        ...


def substituted(a: Sparse, b: Floats, z: Complexes) -> Complexes:
    """Return (z I - A)⁻¹ B for a lower triangular A (n, n), B (n, m) and z (k,), (k, n, m), by forward substitution."""
    x, diagonal = np.zeros((len(z), *b.shape), dtype=np.complex128), a.diagonal()
    for i in range(len(b)):
        row = slice(a.indptr[i], a.indptr[i + 1])
        before = a.indices[row] < i
        known, factors = a.indices[row][before], a.data[row][before]
        x[:, i] = (b[i] + np.tensordot(x[:, known], factors, axes=(1, 0))) / (z - diagonal[i])[:, None]
    return x


def difference(period: float) -> SampledOperator:
    """Return the backward difference (y_k - y_{k-1})/h, D¹ to first order."""
    one = np.ones(1)
    return SampledOperator(csr_array((1, 1)), one, -one / period, 1.0 / period, one)


def trapezoid(period: float) -> SampledOperator:
    """Return the integral of a signal that is linear between samples."""
    one = np.ones(1)
    return SampledOperator(csr_array(np.eye(1)), one * period, one, 0.5 * period, -0.5 * period * one)


def lags(rates: Floats, weights: Floats, direct: float, period: float) -> SampledOperator:
    """Return direct y + Σ_j w_j φ_j, φ_j' = -s_j φ_j + y, φ_j(0) = 0, for y linear between samples: no error.

    The states are φ_j without the part that the present sample has in them.

    Args:
        rates: s_j ≥ 0, (J,).
        weights: w_j, (J,).
        direct: the share of y.
        period: h.
    """
    decay, earlier, present = first_order_hold(rates, period)
    return SampledOperator(
        csr_array(diags_array(decay)), earlier + decay * present, weights, direct + float(weights @ present), -present
    )


def first_order_hold(rates: Floats, period: float) -> tuple[Floats, Floats, Floats]:
    """Return e, g, p with φ_{k+1} = e φ_k + g y_k + p y_{k+1} for φ' = -s φ + y and y linear between samples.

    e = exp(-s h),    p = h (1/x - (1 - e)/x²),    g = h ((1 - e)/x² - e/x),    x = s h
    """
    x = np.asarray(rates, dtype=np.float64) * period
    decay = np.exp(-x)
    small = x < _SMALL
    safe = np.where(small, 1.0, x)
    mean = -np.expm1(-safe) / safe
    present = np.where(small, 0.5 - x / 6.0 + x**2 / 24.0 - x**3 / 120.0 + x**4 / 720.0, (1.0 - mean) / safe)
    earlier = np.where(small, 0.5 - x / 3.0 + x**2 / 8.0 - x**3 / 30.0 + x**4 / 144.0, (mean - decay) / safe)
    return decay, period * earlier, period * present


_SMALL = 1e-3
"""Below this x the differences are taken from their series; the first omitted term is 1e-17 of them."""
