"""Stability of loops of commensurate orders by the eigenvalues of their pseudo-state matrix."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.poles import by_real_part
from fracctl.errors import ArgumentError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.loop import ClosedLoop
from fracctl.stability.assess import ON_THE_AXIS, Verdict

_SAME_ORDER = 1e-9
"""By how much an order may differ from the fraction it is taken for."""
_ON_THE_CUT = 1e-8
"""Distance of |arg σ| from π below which an eigenvalue is none of the principal sheet."""
_SINGULAR = 1e-13
"""Determinant of a matrix over the product of its row sums, below which it counts as singular."""


@dataclass(frozen=True, kw_only=True)
class PseudoStateVerdict(Verdict):
    """A verdict with the eigenvalues that it rests on."""

    eigenvalues: Complexes
    """w, with w^q = σ on the Riemann surface of q sheets."""
    denominator: int
    """q: all orders are multiples of 1/q."""


def matignon(loop: ClosedLoop, largest_denominator: int = 100) -> PseudoStateVerdict:
    """Return the verdict for a single loop whose orders are fractions of a common denominator q.

    With w = σ^(1/q) the characteristic matrix is a polynomial in w, that of the pseudo-state system
    D^(1/q) x = A x. The loop is asymptotically stable exactly if |arg w| > π/(2q) for every eigenvalue w of A; those
    with |arg w| < π/q are its principal-sheet poles σ = w^q. Powers of w that a column has in common are factors
    of the determinant and are taken out of it, for as eigenvalues w = 0 of high multiplicity they would be lost to
    rounding. Groups of coordinates that are not coupled are judged one by one, those of integer orders with q = 1, for
    which poles on the negative real axis count as well.

    Args:
        loop: the closed loop.
        largest_denominator: what q may be; A has 2q rows a position and q an auxiliary state.

    Raises:
        ArgumentError: the loop is a batch, or the orders have no such denominator.
        UnsupportedError: a term has the highest order of its coordinate.

    Source:
        Matignon, Stability results for fractional differential equations (1996); Yaylali, Butcher, Sinclair, Eq. 22.
    """
    if loop.batch is not None:
        raise ArgumentError("loop", f"a batch of {loop.batch}", "must be a single loop; solve a batch for its verdicts")
    blocks = CharacteristicMatrix(loop.system).blocks()
    polynomials = [_polynomial(loop.system, block, largest_denominator) for block in blocks]
    q = _denominator([order for powers in polynomials for order in powers], largest_denominator)
    parts = [
        _eigenvalues(powers, loop.system.highest[block]) for powers, block in zip(polynomials, blocks, strict=True)
    ]
    eigenvalues = np.concatenate([_roots(w, q // own) for w, own, _ in parts])
    poles = by_real_part(np.concatenate([_principal(w, own) for w, own, _ in parts]))
    stable, reason = _decided(poles, any(at_origin for _, _, at_origin in parts), q)
    return PseudoStateVerdict(
        stable=stable,
        poles=poles,
        certificate=f"{reason}, of {len(eigenvalues)} of the pseudo-state matrix",
        method="pseudo-state matrix",
        eigenvalues=eigenvalues,
        denominator=q,
    )


def _decided(poles: Complexes, at_origin: bool, q: int) -> tuple[bool | None, str]:
    if at_origin:
        return None, "det M vanishes at σ = 0 besides the eigenvalues"
    if np.any(np.abs(poles.real) <= ON_THE_AXIS * np.abs(poles)):
        return None, f"an eigenvalue with |arg w| = π/{2 * q}"
    count = int(np.sum(poles.real > 0.0))
    return count == 0, f"{count} eigenvalues with |arg w| < π/{2 * q}"


def _polynomial(system: LinearFractionalSystem, block: list[int], largest: int) -> dict[Fraction, Floats]:
    """Return by order the matrices (p, p) of M(σ) of a block of p coordinates."""
    powers: dict[Fraction, Floats] = {}
    for term in system.dynamics:
        matrix = term.matrix.reshape(system.size, system.size)[np.ix_(block, block)]
        orders = term.orders.reshape(system.size)[block]
        for k in np.flatnonzero(matrix.any(axis=0)):
            order = Fraction(float(orders[k])).limit_denominator(largest)
            if abs(float(order) - orders[k]) > _SAME_ORDER:
                raise _refusal(f"{orders[k]:.12g}", largest)
            powers.setdefault(order, np.zeros(matrix.shape))[:, k] += matrix[:, k]
    return powers


def _denominator(orders: Collection[Fraction], largest: int) -> int:
    q = math.lcm(*(order.denominator for order in orders))
    if q > largest:
        raise _refusal(", ".join(str(order) for order in sorted(set(orders))), largest)
    return q


def _eigenvalues(polynomial: dict[Fraction, Floats], highest: Floats) -> tuple[Complexes, int, bool]:
    """Return w of a block with its own q, that q, and whether det M vanishes at 0 besides."""
    q = math.lcm(*(order.denominator for order in polynomial))
    powers = {int(order * q): matrix for order, matrix in polynomial.items()}
    lowest = np.array([min(n for n, matrix in powers.items() if matrix[:, k].any()) for k in range(len(highest))])
    shifted = _without_common_powers(powers, lowest)
    companion = _companion(shifted, (q * highest).astype(int) - lowest)
    w = np.linalg.eigvals(companion).astype(np.complex128)
    return w, q, _singular(shifted[0]) or lowest.sum() > 0


def _roots(values: Complexes, n: int) -> Complexes:
    """Return all n-th roots."""
    turns = np.exp(2j * np.pi * np.arange(n) / n)
    roots: Complexes = ((np.abs(values) ** (1.0 / n) * np.exp(1j * np.angle(values) / n))[:, None] * turns).ravel()
    return roots


def _refusal(orders: str, largest: int) -> ArgumentError:
    allowed = f"must have orders that are fractions of one denominator up to {largest}"
    return ArgumentError("loop", f"of orders {orders}", allowed, "use `stability.assess`")


def _without_common_powers(powers: dict[int, Floats], lowest: Array) -> dict[int, Floats]:
    """Divide each column k by w^lowest_k; the result has a matrix for n = 0."""
    shifted: dict[int, Floats] = {}
    for n, matrix in powers.items():
        for k in np.flatnonzero(matrix.any(axis=0)):
            shifted.setdefault(n - int(lowest[k]), np.zeros_like(matrix))[:, k] += matrix[:, k]
    return shifted


def _companion(powers: dict[int, Floats], degrees: Array) -> Floats:
    """Return A of x' = A x with x = [y_k, w y_k, …, w^(d_k - 1) y_k] for every coordinate k, d_k its degree."""
    ends = np.cumsum(degrees)
    starts = ends - degrees
    companion = np.eye(int(ends[-1]), k=1)
    for row in np.flatnonzero(degrees):
        last = ends[row] - 1
        companion[last] = 0.0
        for n, matrix in powers.items():
            below = n < degrees
            companion[last, (starts + n)[below]] -= matrix[row, below]
    return companion


def _principal(eigenvalues: Complexes, q: int) -> Complexes:
    """Return σ = w^q of the eigenvalues on the principal sheet."""
    angles = q * np.angle(eigenvalues)
    chosen = np.abs(angles) < np.pi - _ON_THE_CUT if q > 1 else np.ones(len(angles), dtype=bool)
    poles: Complexes = (np.abs(eigenvalues) ** q * np.exp(1j * angles))[chosen]
    return poles


def _singular(matrix: Floats) -> bool:
    scale = float(np.prod(np.maximum(np.abs(matrix).sum(axis=1), 1.0)))
    return abs(float(np.linalg.det(matrix))) <= _SINGULAR * scale
