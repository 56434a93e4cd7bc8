"""Interpolation between Chebyshev-Gauss-Lobatto nodes by the barycentric formula."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats


def lobatto_weights(n: int) -> Floats:
    """Return the barycentric weights of n Chebyshev-Gauss-Lobatto nodes in ascending order, on any interval, (n,)."""
    weights = np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
    weights[[0, -1]] *= 0.5
    return weights


def interpolation(nodes: Floats, weights: Floats, points: Floats) -> Floats:
    """Return the matrix (r, n) that takes values at n nodes to values at r points."""
    gap = points[:, None] - nodes
    hit = gap == 0.0
    rows = hit.any(axis=1)
    gap[hit] = 1.0
    matrix = weights / gap
    matrix[rows] = hit[rows]
    matrix /= matrix.sum(axis=1, keepdims=True)
    return matrix
