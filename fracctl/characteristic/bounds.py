"""A circle that holds all poles of a loop."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.characteristic.matrix import CharacteristicMatrix

SMALLEST_RADIUS = 1e-2
"""Least bound that is returned, also for loops whose poles all lie at the origin."""


_HALVINGS = 6
"""Steps of bisection in the logarithm, which leave the bound 1 % above the root."""


def pole_radius(matrix: CharacteristicMatrix) -> Floats:
    """Return R (b,) such that every zero of det M̃ off the cut has |σ| < R.

    M̃(σ) = I + N(σ) is regular wherever a norm of N is below 1. With the row sums of Σ_e |c_e| r^e, which decrease
    in r, R is the radius at which the largest row sum is 1 (Cauchy's bound, for matrices and real exponents), or
    the same with column sums where that is smaller.
    """
    radius = np.ones(matrix.batch)
    low, high = np.full(matrix.batch, SMALLEST_RADIUS), np.ones(matrix.batch)
    while np.any(grows := _norm(matrix, high) > 1.0):
        low, high = np.where(grows, high, low), np.where(grows, 2.0 * high, high)
    for _ in range(_HALVINGS):
        radius = np.sqrt(low * high)
        above = _norm(matrix, radius) > 1.0
        low, high = np.where(above, radius, low), np.where(above, high, radius)
    return high


def _norm(matrix: CharacteristicMatrix, radius: Floats) -> Floats:
    """Return the smaller of the largest row sum and the largest column sum of |N| on |σ| = radius."""
    size = matrix.size
    magnitudes = np.zeros((size, size, matrix.batch))
    for i in range(size):
        for k in range(size):
            entry = matrix.entries[i][k]
            if entry is not None:
                magnitudes[i, k] = entry.magnitude(radius)
        magnitudes[i, i] -= 1.0
    norm: Floats = np.minimum(magnitudes.sum(axis=1).max(axis=0), magnitudes.sum(axis=0).max(axis=0))
    return norm
