"""Fractional derivatives of uniformly sampled signals that remember every sample: checks on operators that do not.

Both are the discrete convolutions of textbooks. They need the whole past, and converge slowly: what a controller or a
solver uses is `fracctl.fractional.sum_of_exponentials`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import fftconvolve
from scipy.special import gamma

from fracctl.arrays import Floats, finite
from fracctl.errors import ArgumentError


def grunwald_letnikov(values: ArrayLike, step: float, order: float) -> Floats:
    """Return the Riemann-Liouville derivative from the first sample on.

        D^ν y(t_n) ≈ h^(-ν) Σ_{k=0}^n (-1)^k C(ν, k) y(t_{n-k})

    The error is O(h) where y and enough of its derivatives vanish at the first sample (Podlubny, Fractional
    Differential Equations, 1999, section 7.3), otherwise O(h) at a fixed distance from it.

    Args:
        values: y at times 0, h, 2h, …, (…, n).
        step: h > 0.
        order: ν in (0, 1); the integral of order -ν for ν in (-1, 0).

    Raises:
        ArgumentError: an argument lies outside its range.
    """
    y = _samples(values, step, order, -1.0)
    k = np.arange(1, y.shape[-1])
    weights = np.concatenate([[1.0], np.cumprod(1.0 - (order + 1.0) / k)])
    derivative: Floats = _convolved(y, weights) * step**-order
    return derivative


def l1(values: ArrayLike, step: float, order: float) -> Floats:
    """Return the Caputo derivative from the first sample on, exact for lines between samples.

        D^ν y(t_n) ≈ h^(-ν)/Γ(2-ν) Σ_{k=0}^{n-1} ((k+1)^(1-ν) - k^(1-ν)) (y(t_{n-k}) - y(t_{n-k-1}))

    The error is O(h^(2-ν)) for twice differentiable y (Lin and Xu, J. Comput. Phys. 225 (2007) 1533).

    Args:
        values: y at times 0, h, 2h, …, (…, n).
        step: h > 0.
        order: ν in (0, 1).

    Raises:
        ArgumentError: an argument lies outside its range.
    """
    y = _samples(values, step, order, 0.0)
    k = np.arange(1.0, y.shape[-1] - 1)
    later = k ** (1.0 - order) * np.expm1((1.0 - order) * np.log1p(1.0 / k))
    slopes = _convolved(np.diff(y), np.concatenate([[1.0], later])) * step**-order / gamma(2.0 - order)
    return np.concatenate([np.zeros((*y.shape[:-1], 1)), slopes], axis=-1)


def _samples(values: ArrayLike, step: float, order: float, lowest: float) -> Floats:
    y = finite("values", values)
    if y.ndim == 0 or y.shape[-1] < 2:
        raise ArgumentError("values", f"of shape {y.shape}", "must have shape (…, n) with at least two samples")
    if not (np.isfinite(step) and step > 0.0):
        raise ArgumentError("step", step, "must be positive")
    if not lowest < order < 1.0 or order == 0.0:
        allowed = "must lie in (0, 1)" if lowest == 0.0 else "must lie in (-1, 0) or (0, 1)"
        raise ArgumentError("order", order, allowed)
    return y


def _convolved(values: Floats, weights: Floats) -> Floats:
    """Return Σ_k w_k y_{n-k}, shaped as y."""
    full = fftconvolve(values, weights.reshape((1,) * (values.ndim - 1) + (-1,)), axes=-1)
    kept: Floats = full[..., : values.shape[-1]]
    return kept
