"""Floquet multipliers of periodic orbits under time-delayed feedback with the orbit's period as the delay.

Near the orbit y' = A(t) y - B K (y - W), W(t) = (1 - R) y(t - T) + R W(t - T). The monodromy operator takes the states
(and for R > 0 the references) of one period to those of the next; on Chebyshev nodes it is a matrix whose eigenvalues
of largest magnitude converge exponentially. Every multiplier but 0 satisfies det(Φ_μ(T) - μ I) = 0, where Φ_μ belongs
to A - (μ - 1)/(μ - R) B K, which `residual` checks by another integrator.

Source: Just et al., Phys. Rev. Lett. 78 (1997) 203; for R Bleich and Socolar, Phys. Lett. A 210 (1996) 87.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Complexes, Floats, finite, share
from fracctl.controllers.delayed_feedback import GainFunction
from fracctl.errors import ArgumentError
from fracctl.fractional.collocation import chebyshev_nodes
from fracctl.stability.periodic_orbits import PeriodicOrbit

FEWEST_NODES = 40


def multipliers(
    orbit: PeriodicOrbit, gain: ArrayLike | GainFunction | None = None, recall: float = 0.0, nodes: int = 100
) -> Complexes:
    """Return the multipliers by descending magnitude: n of the free motion, otherwise those the nodes resolve.

    Args:
        orbit: the target orbit; the delay is its period.
        gain: K, (m, n), or a function K(t) of times (1, k) that returns (1, k, m, n); None for free motion.
        recall: R in [0, 1).
        nodes: Chebyshev nodes in a period, at least 40. Multipliers below 1e-3 are not to be relied on.

    Raises:
        ArgumentError: a number is out of its range, or the gain has a wrong shape.
    """
    return _eigenvalues(orbit.transition()) if gain is None else Neighbourhood(orbit, nodes).multipliers(gain, recall)


def nontrivial_multipliers(
    orbit: PeriodicOrbit, gain: ArrayLike | GainFunction | None = None, recall: float = 0.0, nodes: int = 100
) -> Complexes:
    """Return the multipliers but those 1 that belong to a periodic solution of the free linearised equation.

    Where y' = A(t) y has solutions of period T, i.e. (Φ(T) - I) y(0) = 0, the control does not see them: each is an
    eigenvector of the monodromy operator to the multiplier 1, whatever the gain. So are the tangent of an orbit of a
    plant that does not depend on time, and of a family of orbits of equal period its other directions. These
    eigenvectors are known (`periodic_directions`) and are deflated; what is left is complete, another 1 among it.

    Args and errors are those of `multipliers`.
    """
    if gain is not None:
        return Neighbourhood(orbit, nodes).nontrivial(gain, recall)
    free = orbit.transition().real
    rest = _complement(periodic_directions(orbit, free))
    return _eigenvalues(rest.T @ free @ rest)


def periodic_directions(orbit: PeriodicOrbit, free: Floats | None = None, margin: float = 1e-6) -> Floats:
    """Return an orthonormal basis of the y with Φ(T) y = y to within the margin, relative to |Φ(T)|, (n, q).

    Args:
        orbit: the orbit.
        free: Φ(T), (n, n), where it is known.
        margin: of the singular values of Φ(T) - I.
    """
    transition = orbit.transition().real if free is None else free
    _, values, right = np.linalg.svd(transition - np.eye(len(transition)))
    return np.ascontiguousarray(right[values <= margin * np.linalg.norm(transition, 2)].T)


class Neighbourhood:
    """The motion near a periodic orbit on Chebyshev nodes, for the multipliers of many gains.

    Args:
        orbit: the target orbit; the delay is its period.
        nodes: Chebyshev nodes in a period, at least 40.

    Raises:
        ArgumentError: there are too few nodes.
    """

    def __init__(self, orbit: PeriodicOrbit, nodes: int = 100) -> None:
        if nodes < FEWEST_NODES:
            raise ArgumentError("nodes", nodes, f"must be at least {FEWEST_NODES}")
        rule = chebyshev_nodes(nodes)
        self.orbit, self.times = orbit, orbit.period * rule.t
        self._a, self._b = orbit.jacobians(self.times)
        self._slope = np.kron(rule.slope / orbit.period, np.eye(self._a.shape[1]))

    def multipliers(self, gain: ArrayLike | GainFunction, recall: float = 0.0) -> Complexes:
        """Return what the function `multipliers` does."""
        return _eigenvalues(self._monodromy(gain, recall))

    def nontrivial(self, gain: ArrayLike | GainFunction, recall: float = 0.0) -> Complexes:
        """Return what `nontrivial_multipliers` does."""
        rest, matrix = self._other_motions, self._monodromy(gain, recall)
        if len(matrix) > len(rest):
            modes = self._modes
            rest = _complement(np.concatenate([modes, modes]))
        return _eigenvalues(rest.T @ matrix @ rest)

    @cached_property
    def _modes(self) -> Floats:
        """The periodic solutions of the free linearised equation at the nodes, one below the other, (t n, q)."""
        modes = self.orbit.motions(periodic_directions(self.orbit), self.times)
        return modes.reshape(len(self._slope), -1)

    @cached_property
    def _other_motions(self) -> Floats:
        return _complement(self._modes)

    def _monodromy(self, gain: ArrayLike | GainFunction, recall: float) -> Floats:
        """Return what takes states at the nodes of a period (and references, for R > 0) to those of the next."""
        recall = share("recall", recall)
        state, reference = self._responses(_gains(self.orbit, gain, self.times))
        old, own = state + (1.0 - recall) * reference, recall * reference
        if recall == 0.0:
            return old
        one = np.eye(len(old))
        return np.block([[old, own], [(1.0 - recall) * one, recall * one]])

    def _responses(self, gains: Floats) -> tuple[Floats, Floats]:
        """Return what states at the nodes of a period owe to the last state before it, and to the reference in it."""
        n, fed = self._a.shape[1], self._b @ gains
        left, right = self._slope.copy(), np.zeros_like(self._slope)
        for i in range(len(self.times)):
            block = slice(i * n, (i + 1) * n)
            left[block, block] -= self._a[i] - fed[i]
            right[block, block] = fed[i]
        left[:n], right[:n] = 0.0, 0.0
        left[:n, :n] = np.eye(n)
        first = np.eye(len(left), n)
        both = np.linalg.solve(left, np.concatenate([first, right], axis=1))
        state = np.zeros_like(left)
        state[:, -n:] = both[:, :n]
        return state, both[:, n:]


def residual(orbit: PeriodicOrbit, gain: ArrayLike | GainFunction, multiplier: complex, recall: float = 0.0) -> float:
    """Return the smallest singular value of Φ_μ(T) - μ I over the largest; 0 for an exact multiplier."""
    factor = (multiplier - 1.0) / (multiplier - recall)
    transition = orbit.transition(lambda t: factor * _gains(orbit, gain, np.array([t]))[0].astype(np.complex128))
    values = np.linalg.svd(transition - multiplier * np.eye(len(transition)), compute_uv=False)
    return float(values[-1] / values[0])


def real_above_one(values: Complexes, margin: float = 1e-6) -> int:
    """Return the number of real multipliers above 1, which delayed feedback cannot change in parity.

    An odd number cannot be stabilised where the plant depends on time (Nakajima 1997); where it does not, the bound is
    that of Hooton and Amann (2012).
    """
    real = np.abs(values.imag) <= margin * np.abs(values)
    return int(np.count_nonzero(real & (values.real > 1.0 + margin)))


def _gains(orbit: PeriodicOrbit, gain: ArrayLike | GainFunction, times: Floats) -> Floats:
    """Return K at times (t,), (t, m, n)."""
    values = finite("gain", gain(times[None])[0] if callable(gain) else gain)
    shape = (orbit.plant.n_controls, orbit.plant.n_states)
    if values.shape[-2:] != shape or values.ndim != 2 + callable(gain):
        raise ArgumentError("gain", f"of shape {values.shape}", f"must have shape {shape} for this plant")
    return np.broadcast_to(values, (len(times), *shape))


def _complement(known: Floats) -> Floats:
    """Return an orthonormal basis of what is orthogonal to some columns."""
    return np.asarray(np.linalg.qr(known, mode="complete")[0][:, known.shape[1] :], dtype=np.float64)


def _eigenvalues(matrix: Complexes | Floats) -> Complexes:
    """Return the eigenvalues by descending magnitude."""
    ordered = np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)
    return ordered[np.argsort(-np.abs(ordered), kind="stable")]
