"""Fractional derivatives and integrals of polynomials as matrices between values on Chebyshev nodes.

On [0, 1] a polynomial is known by its values at the n Chebyshev-Gauss-Lobatto nodes. Its integral

    (I^μ g)(t) = t^μ/Γ(μ) ∫₀¹ (1-τ)^(μ-1) g(tτ) dτ

is a sum over Gauss-Jacobi nodes τ, at which g is interpolated by the barycentric formula: exact up to the degree of
the polynomial, with positive weights, whatever n. The Caputo derivative is D^β = I^(k-β) d^k/dt^k, k = ⌈β⌉. On [0, S]
a matrix of order β is that on [0, 1] times S^-β.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import eigh_tridiagonal
from scipy.special import rgamma

from fracctl.arrays import Floats
from fracctl.fractional.barycentric import interpolation, lobatto_weights

_CACHED = 512
_BEYOND_DEGREE = 12
"""Gauss nodes beyond those for the polynomial's degree, for a power of the distance that doubles on a piece."""


@dataclass(frozen=True)
class ChebyshevNodes:
    """n Chebyshev-Gauss-Lobatto nodes on [0, 1], in ascending order."""

    t: Floats
    weights: Floats
    """Barycentric weights, (n,)."""
    slope: Floats
    """d/dt of the polynomial at the nodes, (n, n), to be applied from the left."""

    def interpolation(self, points: Floats) -> Floats:
        """Return the matrix (r, n) that takes values at the nodes to values at r points."""
        return interpolation(self.t, self.weights, points)


@lru_cache(maxsize=64)
def chebyshev_nodes(n: int) -> ChebyshevNodes:
    """Return n ≥ 2 nodes; differences of nodes and nodes near 0 are right to all digits."""
    k = np.arange(n)
    angle = 0.5 * np.pi / (n - 1)
    t = np.sin(k * angle) ** 2
    weights = lobatto_weights(n)
    gap = np.sin((k[:, None] + k) * angle) * np.sin((k[:, None] - k) * angle) + np.eye(n)
    slope = (weights / weights[:, None]) / gap
    np.fill_diagonal(slope, 0.0)
    np.fill_diagonal(slope, -slope.sum(axis=1))
    return ChebyshevNodes(t, weights, slope)


def integral_matrix(n: int, order: float, points: Floats | None = None) -> Floats:
    """Return the matrix (r, n) of I^order, order ≥ 0, from values at n nodes to r points (default: the nodes)."""
    nodes = chebyshev_nodes(n)
    if points is None:
        return _integral_at_nodes(n, order)
    if order == 0.0:
        return nodes.interpolation(points)
    tau, weights = _jacobi(n // 2 + 1, order)
    basis = nodes.interpolation(np.ravel(points[:, None] * tau)).reshape(len(points), len(tau), n)
    matrix: Floats = (points**order * rgamma(order))[:, None] * np.tensordot(basis, weights, axes=(1, 0))
    return matrix


@lru_cache(maxsize=_CACHED)
def _integral_at_nodes(n: int, order: float) -> Floats:
    return integral_matrix(n, order, chebyshev_nodes(n).t)


def derivative_matrix(n: int, order: float, points: Floats | None = None) -> Floats:
    """Return the matrix (r, n) of the Caputo derivative, of the integral for order < 0; order ≤ 2.

    Args:
        n: number of nodes.
        order: β.
        points: where the derivative is wanted, (r,) in [0, 1]; None for the nodes.
    """
    if points is None:
        return _derivative_at_nodes(n, order)
    matrix = integral_matrix(n, max(np.ceil(order), 0.0) - order, points)
    for _ in range(int(max(np.ceil(order), 0.0))):
        matrix = matrix @ chebyshev_nodes(n).slope
    return matrix


@lru_cache(maxsize=_CACHED)
def _derivative_at_nodes(n: int, order: float) -> Floats:
    return derivative_matrix(n, order, chebyshev_nodes(n).t)


@lru_cache(maxsize=_CACHED)
def memory_matrix(n: int, order: float, distance: int) -> Floats:
    """Return what the integral I^order over [0, 1] adds at the n nodes of [distance, distance + 1], (n, n).

        (M g)(t) = 1/Γ(μ) ∫₀¹ (t-τ)^(μ-1) g(τ) dτ,    t = distance + node

    Applied from the left to the values of a polynomial g at the nodes of [0, 1]; exact to rounding.
    """
    if order == 0.0:
        return np.zeros((n, n))
    reach, weights, basis = _memory_basis(n, distance)
    matrix: Floats = rgamma(order) * np.einsum("ij,ijk->ik", weights * reach ** (order - 1.0), basis)
    if distance == 1:
        matrix[0] = integral_matrix(n, order)[-1]
    return matrix


@lru_cache(maxsize=16)
def _memory_basis(n: int, distance: int) -> tuple[Floats, Floats, Floats]:
    """Return quadrature points as distances t-τ (n, Q), weights, and the interpolation to them (n, Q, n).

    The range of t-τ is split geometrically, no piece longer than it is away from the singularity.
    """
    nodes = chebyshev_nodes(n)
    nearest = distance - 1.0 + nodes.t
    if distance == 1:
        nearest[0] = nearest[1]
    pieces = int(np.ceil(np.log2(1.0 + 1.0 / nearest.min())))
    x, w = _legendre(n // 2 + _BEYOND_DEGREE)
    edges = nearest[:, None] * (1.0 + 1.0 / nearest[:, None]) ** (np.arange(pieces + 1) / pieces)
    half = 0.5 * np.diff(edges)
    reach = (edges[:, :-1, None] + half[..., None] * (x + 1.0)).reshape(n, -1)
    weights = (half[..., None] * w).reshape(n, -1)
    points = np.clip(nearest[:, None] + 1.0 - reach, 0.0, 1.0)
    return reach, weights, nodes.interpolation(points.ravel()).reshape(n, -1, n)


@lru_cache(maxsize=_CACHED)
def _legendre(count: int) -> tuple[Floats, Floats]:
    x, w = np.polynomial.legendre.leggauss(count)
    return x, w


@lru_cache(maxsize=_CACHED)
def _jacobi(count: int, order: float) -> tuple[Floats, Floats]:
    """Return nodes and weights on [0, 1] for the weight (1-τ)^(order-1).

    Golub and Welsch's eigenvalues: exact to a few units of rounding also for small orders, where a root finder loses
    the distance of the last nodes from 1.
    """
    k = np.arange(1.0, count)
    twice = 2.0 * k + order - 1.0
    diagonal = np.concatenate([[(1.0 - order) / (1.0 + order)], -((order - 1.0) ** 2) / (twice * (twice + 2.0))])
    squares = (2.0 * k * (k + order - 1.0) / twice) ** 2 / ((twice + 1.0) * np.where(k == 1.0, 1.0, twice - 1.0))
    squares[:1] = 4.0 * order / ((1.0 + order) ** 2 * (2.0 + order))
    x, vectors = eigh_tridiagonal(diagonal, np.sqrt(squares))
    return np.asarray(0.5 * (1.0 + x), dtype=np.float64), np.asarray(vectors[0] ** 2 / order, dtype=np.float64)


def power_derivative(exponent: float, order: float, times: Floats) -> Floats:
    """Return the Caputo derivative (the integral for order < 0) of t^exponent / Γ(exponent + 1) at times (t,)."""
    if order > exponent == np.floor(exponent):
        return np.zeros_like(times)
    derivative: Floats = times ** (exponent - order) * rgamma(exponent - order + 1.0)
    return derivative
