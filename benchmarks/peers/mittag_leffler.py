"""pymittagleffler: the closed solution of the loop for rational orders, in Mittag-Leffler functions.

With α_j = p_j/q and λ = σ^(1/q) the characteristic matrix M is a polynomial in λ, and the transform R of ξ' has simple
poles λ_i, 2mq of them on all sheets, with residues ρ_i. Then

    ξ(t) = ξ₀ + Σ ρ_i g_i(t),    D^α_j ξ_j(t) = Σ λ_i^(p_j) ρ_ij g_i(t),    g_i(t) = (E_(1/q)(λ_i t^(1/q)) - 1)/λ_i

exactly. Of each pair of conjugate poles one is computed. Commensurate orders with few terms are the best case of this
method: q is 100 for orders in hundredths.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from pymittagleffler import mittag_leffler

from benchmarks.peers.base import Solution, output_times
from tests.references.loops import Floats, Loop

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class MittagLeffler:
    """The closed solution; it has no setting."""

    package = "pymittagleffler"
    method = "closed solution"
    setting = "exact"
    loops = 1
    ladder = True

    def __call__(self, loops: Sequence[Loop], horizon: float) -> list[Solution]:
        """Solve loops on [0, horizon]."""
        return [self._solve(loop, horizon) for loop in loops]

    def _solve(self, loop: Loop, horizon: float) -> Solution:
        times = output_times(horizon)
        q, p = common_denominator(loop.alpha)
        poles, residues = poles_and_residues(loop, q, p)
        functions = (mittag_leffler(poles[:, None] * times ** (1.0 / q), 1.0 / q, 1.0) - 1.0) / poles[:, None]
        positions = loop.value + (functions.T @ residues).real
        caputo = (functions.T @ (residues * poles[:, None] ** np.array(p))).real
        return Solution(times, positions, -positions @ loop.k_p.T - caputo @ loop.k_d.T)


def common_denominator(alpha: Floats) -> tuple[int, list[int]]:
    """Return q and p with α = p/q."""
    fractions = [Fraction(order).limit_denominator(1000) for order in alpha.tolist()]
    q = math.lcm(*[fraction.denominator for fraction in fractions])
    return q, [int(fraction * q) for fraction in fractions]


def poles_and_residues(loop: Loop, q: int, p: list[int]) -> tuple[Complexes, Complexes]:
    """Return λ with Im λ ≥ 0, (n,), and their residues of R, (n, m), doubled for those that stand for a pair."""
    m = range(loop.size)
    gap = loop.k_p - loop.stiffness

    def entry(i: int, j: int) -> Floats:
        return _polynomial((2 * q, float(i == j)), (q, -loop.damping[i, j]), (p[j], loop.k_d[i, j]), (0, gap[i, j]))

    entries = [[entry(i, j) for j in m] for i in m]
    right = [_polynomial((q, loop.rate[i]), (0, -(gap @ loop.value)[i])) for i in m]
    determinant, numerators = _adjugate(entries, right)
    slope = np.polyder(determinant)
    roots = np.roots(determinant).astype(np.complex128)
    for _ in range(3):
        roots -= np.polyval(determinant, roots) / np.polyval(slope, roots)
    real = np.abs(roots.imag) < 1e-12
    kept = real | (roots.imag > 0.0)
    roots, weight = roots[kept], np.where(real[kept], 1.0, 2.0)
    residues = [weight * np.polyval(numerator, roots) / np.polyval(slope, roots) for numerator in numerators]
    return roots, np.stack(residues, axis=-1)


def _polynomial(*terms: tuple[int, float]) -> Floats:
    """Return coefficients, the highest first, of Σ c λ^n for terms (n, c)."""
    coefficients = np.zeros(max(power for power, _ in terms) + 1)
    for power, coefficient in terms:
        coefficients[-1 - power] += coefficient
    return coefficients


def _adjugate(entries: list[list[Floats]], right: list[Floats]) -> tuple[Floats, list[Floats]]:
    """Return det M and adj(M) r."""
    if len(right) == 1:
        return entries[0][0], right
    (a, b), (c, d) = entries
    determinant = np.polysub(np.polymul(a, d), np.polymul(b, c))
    first = np.polysub(np.polymul(d, right[0]), np.polymul(b, right[1]))
    return determinant, [first, np.polysub(np.polymul(a, right[1]), np.polymul(c, right[0]))]
