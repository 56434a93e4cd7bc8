"""The scaled characteristic matrix M̃(σ) = Σ_j A_j diag(σ^(β_j - ℓ)), ℓ the highest order of each coordinate.

M̃ → I as |σ| → ∞; its zeros off the cut (-∞, 0] are the principal-sheet poles of the loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import FractionalTerm, powers


@dataclass(frozen=True)
class Entry:
    """One entry of a matrix of sums of powers, Σ_e c_e σ^e."""

    coefficients: Floats
    """c, (J,) or (b, J)."""
    exponents: Floats
    """e, (J,) or (b, J)."""

    def __call__(self, sigma: Complexes) -> Complexes:
        """Return the entry at nodes σ, (k,) or (b, k), as (k,) or (b, k)."""
        if self.exponents.ndim == 1 and sigma.ndim == 1:
            basis = powers(sigma, self.exponents)
            if self.coefficients.ndim == 1:
                return self.coefficients @ basis
            return (self.coefficients @ basis.view(np.float64)).view(np.complex128)
        logarithm = np.log(sigma)
        total = np.zeros(np.broadcast_shapes(logarithm.shape, (*self._lead, 1)), dtype=np.complex128)
        for j in range(self.exponents.shape[-1]):
            e, c = self.exponents[..., j, None], self.coefficients[..., j, None]
            total += c * np.exp(e * logarithm)
        return total

    @property
    def _lead(self) -> tuple[int, ...]:
        return np.broadcast_shapes(self.coefficients.shape[:-1], self.exponents.shape[:-1])

    def magnitude(self, radius: Floats) -> Floats:
        """Return Σ_e |c_e| r^e for radii r (b,)."""
        total: Floats = np.sum(np.abs(self.coefficients) * radius[:, None] ** self.exponents, axis=-1)
        return total


PowerTable = Callable[[Floats], tuple[Floats, Floats]]
"""From exponents (J,) or (b, J) to real and imaginary parts of powers along a path, (1, J, P) or (b, J, P)."""

_ZERO = Entry(np.zeros(1), np.zeros(1))


class CharacteristicMatrix:
    """M̃(σ) of a linear fractional system, with the batch axis of its gains.

    Args:
        system: the loop's equation.
    """

    def __init__(self, system: LinearFractionalSystem) -> None:
        self.system = system
        self.size = system.size
        self.batch = system.batch or 1
        self.highest = system.highest
        self.entries = [
            [_entry(system.dynamics, i, k, float(self.highest[k])) for k in range(self.size)] for i in range(self.size)
        ]

    def __call__(self, sigma: Complexes) -> list[list[Complexes | None]]:
        """Return the entries at nodes σ, each (k,) or (b, k), or None where the entry is zero."""
        return [[None if entry is None else entry(sigma) for entry in row] for row in self.entries]

    def blocks(self) -> list[list[int]]:
        """Return the groups of coordinates that are not coupled to each other."""
        groups: list[set[int]] = []
        for i in range(self.size):
            linked = {i} | {k for k in range(self.size) if self.entries[i][k] or self.entries[k][i]}
            joined = [group for group in groups if group & linked]
            groups = [group for group in groups if not group & linked] + [linked.union(*joined)]
        return sorted(sorted(group) for group in groups)

    def tables(self, block: list[int], table: PowerTable) -> tuple[tuple[Floats, Floats, Floats], ...]:
        """Return the entries of a block, row by row, as coefficients (b, J) and the table of their powers."""
        entries = [self.entries[i][k] or _ZERO for i in block for k in block]
        return tuple((self._coefficients(entry), *table(entry.exponents)) for entry in entries)

    def _coefficients(self, entry: Entry) -> Floats:
        shape = (self.batch, entry.exponents.shape[-1])
        return np.array(np.broadcast_to(entry.coefficients, shape), order="C")

    def take(self, rows: Array) -> CharacteristicMatrix:
        """Return the matrix of the members `rows`."""
        return CharacteristicMatrix(self.system.take(rows))

    def determinant(self, sigma: Complexes, block: list[int] | None = None) -> Complexes:
        """Return det M̃, or that of a block of it, at nodes σ, (k,) shared or (b, k) one set a member, as (b, k)."""
        shape = (self.batch, sigma.shape[-1])
        rows = range(self.size) if block is None else block
        entries = [[entry(sigma) if (entry := self.entries[i][k]) else None for k in rows] for i in rows]
        return np.broadcast_to(determinant(entries, shape), shape)


def determinant(entries: list[list[Complexes | None]], shape: tuple[int, ...]) -> Complexes:
    """Return the determinant of a matrix of node values; `shape` is that of a node array."""
    size = len(entries)
    if size == 1:
        first = entries[0][0]
        assert first is not None
        return first
    if size == 2:
        (a, b), (c, d) = entries
        assert a is not None
        assert d is not None
        product = a * d
        return product if b is None or c is None else product - b * c
    values: Complexes = np.linalg.det(stack(entries, shape))
    return values


def stack(entries: list[list[Complexes | None]], shape: tuple[int, ...]) -> Complexes:
    """Return node values of all entries as one array, shape + (p, p)."""
    size = len(entries)
    matrix = np.zeros((*shape, size, size), dtype=np.complex128)
    for i, row in enumerate(entries):
        for k, value in enumerate(row):
            if value is not None:
                matrix[..., i, k] = value
    return matrix


def _entry(terms: tuple[FractionalTerm, ...], row: int, column: int, highest: float) -> Entry | None:
    """Collect entry (row, column) of the terms, merging equal shared orders; None where it is zero."""
    shared: dict[float, Floats] = {}
    own: list[tuple[Floats, Floats]] = []
    for term in terms:
        coefficient, order = term.matrix[..., row, column], term.orders[..., column] - highest
        if not np.any(coefficient):
            continue
        if order.ndim == 0:
            shared[float(order)] = shared.get(float(order), np.zeros(())) + coefficient
        else:
            own.append((coefficient, order))
    if not shared and not own:
        return None
    coefficients = [*shared.values(), *(c for c, _ in own)]
    exponents = [*(np.asarray(e) for e in shared), *(e for _, e in own)]
    return Entry(_columns(coefficients), _columns(exponents))


def _columns(values: list[Floats]) -> Floats:
    return np.ascontiguousarray(np.stack(np.broadcast_arrays(*values), axis=-1))
