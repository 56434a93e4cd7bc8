"""Principal-sheet poles of one loop: the zeros of det M̃ off the cut (-∞, 0]."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Complexes
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.errors import ArgumentError

_LIP = 1e-9
"""Angle in rad between the upper lip of the cut and the path along it."""


def principal_poles(matrix: CharacteristicMatrix) -> tuple[Complexes, bool]:
    """Return all zeros of det M̃ with |arg σ| < π, and whether their number is that of the argument principle.

    Newton's iteration from a polar mesh of the upper half disc of the pole radius, with the zeros found so far
    divided out. For integer orders the zeros on the negative real axis are found as well.

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
    expected = _count(matrix)
    radius = float(pole_radius(matrix)[0])
    poles: list[complex] = []
    for n_radii, n_angles in ((24, 17), (80, 61), (240, 181)):
        poles = _distinct(_newton(matrix, _mesh(radius, n_radii, n_angles)))
        if len(poles) >= expected:
            break
    ordered = sorted(poles, key=lambda p: (-p.real, abs(p.imag), -p.imag))
    return np.array(ordered, dtype=np.complex128), len(poles) == expected


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


def _count(matrix: CharacteristicMatrix) -> int:
    """Number of zeros with |arg σ| < π - lip, by the argument principle with a densely sampled path."""
    outer = 2.0 * float(pole_radius(matrix)[0])
    for n in (2000, 16000, 128000):
        lip = np.exp(1j * (np.pi - _LIP)) * np.geomspace(outer, 1e-8, n)
        arc = 1e-8 * np.exp(1j * np.linspace(np.pi - _LIP, 0.0, 400))
        sweep = outer * np.exp(1j * np.linspace(0.0, np.pi - _LIP, 400))
        values = matrix.determinant(np.concatenate([sweep, lip[1:], arc[1:]]))[0]
        steps = np.angle(values[1:] / values[:-1])
        if np.max(np.abs(steps)) < 1.5:
            break
    return round(float(np.sum(steps)) / np.pi)


def _mesh(radius: float, n_radii: int, n_angles: int) -> Complexes:
    radii = radius * np.geomspace(1e-9, 1.0, n_radii)
    angles = np.linspace(0.0, np.pi - 0.02, n_angles)
    return np.ravel(radii[:, None] * np.exp(1j * angles))


def _newton(matrix: CharacteristicMatrix, sigma: Complexes) -> Complexes:
    """Return where Newton's iteration on det M̃ ends for each start, without the starts that leave the cut plane."""
    settled = np.zeros(sigma.shape, dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(80):
            step = 1e-6 * np.abs(sigma)
            value, ahead, behind = matrix.determinant(np.concatenate([sigma, sigma + step, sigma - step]))[0].reshape(
                3, -1
            )
            change = np.where(value == 0.0, 0.0, -value * 2.0 * step / (ahead - behind))
            change *= np.minimum(1.0, 0.5 * np.abs(sigma) / np.maximum(np.abs(change), 1e-300))
            sigma = sigma + change
            settled = np.abs(change) < 1e-12 * np.abs(sigma)
            keep = np.isfinite(sigma) & (np.abs(np.angle(sigma)) < np.pi - _LIP)
            sigma, settled = sigma[keep], settled[keep]
            if settled.all():
                break
    return sigma[settled]


def _distinct(zeros: Complexes) -> list[complex]:
    """Return the different ones of `zeros`, completed by their conjugates."""
    found: list[complex] = []
    for zero in zeros:
        pole = complex(zero.real) if abs(zero.imag) < 1e-9 * abs(zero) else complex(zero.real, abs(zero.imag))
        if all(abs(pole - p) > 1e-7 * abs(p) for p in found):
            found += [pole] if pole.imag == 0.0 else [pole, pole.conjugate()]
    return found
