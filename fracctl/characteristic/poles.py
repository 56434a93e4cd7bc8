"""Principal-sheet poles of one loop: the zeros of det M̃ off the cut (-∞, 0]."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Complexes, Floats
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix, Powers
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

    Groups of coordinates that are not coupled are taken one by one. For integer orders the poles are the eigenvalues
    of the first-order form, those on the negative real axis among them. Otherwise, Newton's iteration from a polar mesh
    of the upper half disc of the pole radius, with the zeros found so far divided out; a double zero is found twice,
    one with |σ| < 4e-18 not at all.

    Args:
        matrix: the characteristic matrix of a single loop (batch of one).

    Returns:
        Poles by descending real part, conjugate pairs together, and whether the set is complete.

    Raises:
        ArgumentError: the matrix belongs to a batch of several loops.
    """
    if matrix.batch != 1:
        raise ArgumentError("matrix", f"a batch of {matrix.batch}", "must belong to a single loop")
    outer = float(np.log(pole_radius(matrix)[0]))
    parts = [_of_block(matrix.powers_of(block), matrix.highest[block], outer) for block in matrix.blocks()]
    return by_real_part(np.concatenate([poles for poles, _ in parts])), all(complete for _, complete in parts)


def by_real_part(poles: Complexes) -> Complexes:
    """Return poles by descending real part, conjugate pairs together, that above the axis first."""
    return poles[np.lexsort((-poles.imag, np.abs(poles.imag), -poles.real))]


def _of_block(powers: Powers, highest: Floats, outer: float) -> tuple[Complexes, bool]:
    """Return the zeros of a block and whether they are all; log |σ| is below `outer`."""
    orders = powers.exponents[0] + highest[powers.place[:, 1]]
    if np.all(orders % 1.0 == 0.0):
        return _companion_eigenvalues(powers, orders, highest), True
    rows, columns = np.ascontiguousarray(powers.place.T)
    terms = Terms(len(highest), powers.coefficients[0], powers.exponents[0], rows, columns)
    expected = _count(terms, outer)
    found = np.zeros(0, dtype=np.complex128)
    for n_radii, n_angles in _MESHES:
        found = search(terms, _mesh(outer, n_radii, n_angles), expected, np.pi - _LIP)
        if len(found) >= expected:
            break
    return np.exp(found), len(found) == expected


def _companion_eigenvalues(powers: Powers, orders: Floats, highest: Floats) -> Complexes:
    """Eigenvalues of the first-order form, for orders -1, 0, 1, 2 (order -1 adds as many integrals as it has rank)."""
    p, m = len(highest), int(np.sum(highest == 2.0))
    blocks = {order: np.zeros((p, p)) for order in (-1, 0, 1, 2)}
    for (row, column), order, coefficient in zip(powers.place, orders, powers.coefficients[0], strict=True):
        blocks[int(order)][row, column] += coefficient
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
    return np.linalg.eigvals(companion).astype(np.complex128)


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
