"""Principal-sheet poles of one loop: the zeros of det M̃ off the cut (-∞, 0]."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Complexes
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.zeros import Terms, phase_change, search
from fracctl.errors import ArgumentError

_LIP = 1e-9
"""Angle in rad between the upper lip of the cut and the path along it."""
_INNERMOST = -40.0
"""Logarithm of the smallest magnitude of a pole that is looked for."""
_MARGIN = 0.7
"""Logarithm of the path's outer radius over the pole radius."""
_MESHES = ((16, 5), (50, 17), (250, 61))
"""Radii and angles of the starts, the next where one leaves zeros unfound."""


def principal_poles(matrix: CharacteristicMatrix) -> tuple[Complexes, bool]:
    """Return all zeros of det M̃ with |arg σ| < π, and whether their number is that of the argument principle.

    Newton's iteration from a polar mesh of the upper half disc of the pole radius, with the zeros found so far
    divided out; a double zero is found twice, one with |σ| < 4e-18 not at all. For integer orders the zeros on the
    negative real axis are found as well.

    Args:
        matrix: the characteristic matrix of a single loop (batch of one).

    Returns:
        Poles by descending real part, conjugate pairs together, and whether the set is complete.

    Raises:
        ArgumentError: the matrix belongs to a batch of several loops.
    """
    if matrix.batch != 1:
        raise ArgumentError("matrix", f"a batch of {matrix.batch}", "must belong to a single loop")
    if _integer_orders(matrix):
        return _companion_eigenvalues(matrix), True
    terms, outer = _terms(matrix), float(np.log(pole_radius(matrix)[0]))
    expected = _count(terms, outer)
    found = np.zeros(0, dtype=np.complex128)
    for n_radii, n_angles in _MESHES:
        found = search(terms, _mesh(outer, n_radii, n_angles), expected, np.pi - _LIP)
        if len(found) >= expected:
            break
    poles = np.exp(found)
    return poles[np.lexsort((-poles.imag, np.abs(poles.imag), -poles.real))], len(poles) == expected


def _integer_orders(matrix: CharacteristicMatrix) -> bool:
    return all(np.all(term.orders[term.matrix.any(axis=-2)] % 1.0 == 0.0) for term in _squeezed(matrix))


def _squeezed(matrix: CharacteristicMatrix) -> list[_Term]:
    return [_Term(t.matrix.reshape(t.matrix.shape[-2:]), t.orders.reshape(-1)) for t in matrix.system.dynamics]


class _Term:
    def __init__(self, matrix: np.ndarray, orders: np.ndarray) -> None:
        self.matrix, self.orders = matrix, orders


def _companion_eigenvalues(matrix: CharacteristicMatrix) -> Complexes:
    """Eigenvalues of the first-order form, for orders -1, 0, 1, 2 (order -1 adds as many integrals as it has rank)."""
    p, m = matrix.size, matrix.system.n_positions
    blocks = {order: np.zeros((p, p)) for order in (-1, 0, 1, 2)}
    for term in _squeezed(matrix):
        for k, order in enumerate(term.orders):
            if term.matrix[:, k].any():
                blocks[int(order)][:, k] += term.matrix[:, k]
    left, sizes, right = np.linalg.svd(blocks[-1])
    rank = int(np.sum(sizes > 1e-13 * sizes[0]))
    # state: y (p), rates of positions (m), integrals of combinations of y (rank)
    companion = np.zeros((p + m + rank, p + m + rank))
    companion[:m, p : p + m] = np.eye(m)
    rows = np.r_[p : p + m, m:p]
    companion[rows, :p] = -blocks[0]
    companion[rows, p : p + m] = -blocks[1][:, :m]
    companion[rows, p + m :] = -left[:, :rank] * sizes[:rank]
    companion[p + m :, :p] = right[:rank]
    values = np.linalg.eigvals(companion).astype(np.complex128)
    return values[np.lexsort((-values.imag, np.abs(values.imag), -values.real))]


def _terms(matrix: CharacteristicMatrix) -> Terms:
    entries = [(i, k, entry) for i, row in enumerate(matrix.entries) for k, entry in enumerate(row) if entry]
    counts = [entry.exponents.shape[-1] for _, _, entry in entries]
    rows, columns = (np.repeat([entry[axis] for entry in entries], counts) for axis in (0, 1))
    coefficients = np.concatenate([entry.coefficients.ravel() for _, _, entry in entries])
    exponents = np.concatenate([entry.exponents.ravel() for _, _, entry in entries])
    return Terms(matrix.size, coefficients, exponents, rows, columns)


def _count(terms: Terms, outer: float) -> int:
    """Number of zeros with |arg σ| < π - lip, by the argument principle along the upper half of the border."""
    top = 1j * (np.pi - _LIP)
    ends = (outer + _MARGIN, _INNERMOST)
    corners = np.array([ends[0], ends[0] + top, ends[1] + top, ends[1]], dtype=np.complex128)
    return round(phase_change(terms, corners) / np.pi)


def _mesh(outer: float, n_radii: int, n_angles: int) -> Complexes:
    """Return starts z = log σ, from the outermost inwards."""
    radii = np.linspace(outer, _INNERMOST, n_radii)
    angles = np.linspace(0.0, np.pi - 0.02, n_angles)
    return np.ravel(radii[:, None] + 1j * angles).astype(np.complex128)
