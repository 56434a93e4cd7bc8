"""Floquet multipliers of periodic orbits under time-delayed feedback with the orbit's period as the delay.

Near the orbit y' = A(t) y - B K (y - W), W(t) = (1 - R) y(t - T) + R W(t - T). The monodromy operator takes the states
(and for R > 0 the references) of one period to those of the next; on Chebyshev nodes it is a matrix whose eigenvalues
of largest magnitude converge exponentially. Every multiplier but 0 satisfies det(Φ_μ(T) - μ I) = 0, where Φ_μ belongs
to A - (μ - 1)/(μ - R) B K, which `residual` checks by another integrator.

Source: Just et al., Phys. Rev. Lett. 78 (1997) 203; for R Bleich and Socolar, Phys. Lett. A 210 (1996) 87.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Complexes, Floats, finite, share
from fracctl.errors import ArgumentError
from fracctl.stability.periodic_orbits import PeriodicOrbit

FEWEST_NODES = 40


def multipliers(
    orbit: PeriodicOrbit, gain: ArrayLike | None = None, recall: float = 0.0, nodes: int = 100
) -> Complexes:
    """Return the multipliers by descending magnitude: n of the free motion, otherwise those the nodes resolve.

    Args:
        orbit: the target orbit; the delay is its period.
        gain: K, (m, n); None for free motion.
        recall: R in [0, 1).
        nodes: Chebyshev nodes in a period, at least 40. Multipliers below 1e-3 are not to be relied on.

    Raises:
        ArgumentError: a number is out of its range, or the gain has a wrong shape.
    """
    if gain is None:
        return _eigenvalues(orbit.transition())
    matrix, recall = _gain(orbit, gain), share("recall", recall)
    if nodes < FEWEST_NODES:
        raise ArgumentError("nodes", nodes, f"must be at least {FEWEST_NODES}")
    state, reference = _responses(orbit, matrix, nodes)
    old, own = state + (1.0 - recall) * reference, recall * reference
    if recall == 0.0:
        return _eigenvalues(old)
    one = np.eye(len(old))
    return _eigenvalues(np.block([[old, own], [(1.0 - recall) * one, recall * one]]))


def residual(orbit: PeriodicOrbit, gain: ArrayLike, multiplier: complex, recall: float = 0.0) -> float:
    """Return the smallest singular value of Φ_μ(T) - μ I over the largest; 0 for an exact multiplier."""
    factor = (multiplier - 1.0) / (multiplier - recall)
    transition = orbit.transition(factor * _gain(orbit, gain).astype(np.complex128))
    values = np.linalg.svd(transition - multiplier * np.eye(len(transition)), compute_uv=False)
    return float(values[-1] / values[0])


def real_above_one(values: Complexes, margin: float = 1e-6) -> int:
    """Return the number of real multipliers above 1, which delayed feedback cannot change in parity.

    An odd number cannot be stabilised where the plant depends on time (Nakajima 1997); where it does not, the bound is
    that of Hooton and Amann (2012).
    """
    real = np.abs(values.imag) <= margin * np.abs(values)
    return int(np.count_nonzero(real & (values.real > 1.0 + margin)))


def _responses(orbit: PeriodicOrbit, gain: Floats, nodes: int) -> tuple[Floats, Floats]:
    """Return what states at the nodes of a period owe to the last state before it, and to the reference in it."""
    t, slope = _chebyshev(nodes, orbit.period)
    a, b = orbit.jacobians(t)
    n, fed = a.shape[1], b @ gain
    left = np.kron(slope, np.eye(n))
    right = np.zeros_like(left)
    for i in range(nodes):
        block = slice(i * n, (i + 1) * n)
        left[block, block] -= a[i] - fed[i]
        right[block, block] = fed[i]
    left[:n], right[:n] = 0.0, 0.0
    left[:n, :n] = np.eye(n)
    start = np.zeros_like(left)
    start[:n, -n:] = np.eye(n)
    both = np.linalg.solve(left, np.concatenate([start, right], axis=1))
    return both[:, : len(left)], both[:, len(left) :]


def _chebyshev(nodes: int, length: float) -> tuple[Floats, Floats]:
    """Return Chebyshev-Lobatto nodes in [0, length] and the matrix of the derivative at them."""
    k = np.arange(nodes)
    t = length * np.sin(0.5 * np.pi * k / (nodes - 1)) ** 2
    weights = np.where(k % 2 == 0, 1.0, -1.0)
    weights[[0, -1]] *= 0.5
    slope = weights / weights[:, None] / (t[:, None] - t + np.eye(nodes))
    np.fill_diagonal(slope, 0.0)
    np.fill_diagonal(slope, -slope.sum(axis=1))
    return t, slope


def _gain(orbit: PeriodicOrbit, gain: ArrayLike) -> Floats:
    matrix, shape = finite("gain", gain), (orbit.plant.n_controls, orbit.plant.n_states)
    if matrix.shape != shape:
        raise ArgumentError("gain", f"of shape {matrix.shape}", f"must have shape {shape} for this plant")
    return matrix


def _eigenvalues(matrix: Complexes | Floats) -> Complexes:
    """Return the eigenvalues by descending magnitude."""
    ordered = np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)
    return ordered[np.argsort(-np.abs(ordered), kind="stable")]
