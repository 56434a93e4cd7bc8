"""The scaled characteristic matrix M̃(σ) = Σ_j A_j diag(σ^(β_j - ℓ)), ℓ the highest order of each coordinate.

M̃ → I as |σ| → ∞; its zeros off the cut (-∞, 0] are the principal-sheet poles of the loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.errors import UnsupportedError
from fracctl.fractional.system import LinearFractionalSystem, unsolved_for_highest
from fracctl.fractional.terms import powers


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


class Powers(NamedTuple):
    """All entries of a block as one list of K powers c σ^e, each in its row and column of the block."""

    coefficients: Floats
    """c, (b, K)."""
    exponents: Floats
    """e, (1, K) where members share them, (b, K) otherwise."""
    place: Array
    """Row and column, (K, 2)."""

    def take(self, rows: Array) -> Powers:
        """Return those of the members `rows`."""
        exponents = self.exponents[rows] if len(self.exponents) > 1 else self.exponents
        return Powers(self.coefficients[rows], exponents, self.place)


class CharacteristicMatrix:
    """M̃(σ) of a linear fractional system, with the batch axis of its gains.

    Args:
        system: the loop's equation.

    Raises:
        UnsupportedError: a term has the highest order of its coordinate, so that M̃ does not tend to I.
    """

    def __init__(self, system: LinearFractionalSystem) -> None:
        self.system = system
        self.size = system.size
        self.batch = system.batch or 1
        self.highest = system.highest
        self.entries = _entries(system)

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

    def split(self, block: list[int]) -> tuple[list[int], list[int]]:
        """Split a block into coordinates and auxiliary states that these determine one by one, as filters and lags do.

        Row and column of such a state hold no other of them, and its own entry is 1 + Σ c σ^e with c ≥ 0 and
        -1 ≤ e < 0, which has no zeros off the cut: above the real axis no power points up.
        """
        found: list[int] = []
        for k in (k for k in block if k >= self.system.n_positions):
            own = self.entries[k][k]
            lags = own is not None and bool(np.all(own.coefficients >= 0.0) and np.all(own.exponents >= -1.0))
            if lags and not any(self.entries[k][j] or self.entries[j][k] for j in found):
                found.append(k)
        return [i for i in block if i not in found], found

    def powers_of(self, block: list[int]) -> Powers:
        """Return the powers of a block."""
        entries = [
            (i, k, entry)
            for i, row in enumerate(block)
            for k, column in enumerate(block)
            if (entry := self.entries[row][column])
        ]
        counts = [entry.exponents.shape[-1] for _, _, entry in entries]
        shared = all(entry.exponents.ndim == 1 for _, _, entry in entries)
        coefficients = np.empty((self.batch, sum(counts)))
        exponents = np.empty((1 if shared else self.batch, sum(counts)))
        at = 0
        for (_, _, entry), count in zip(entries, counts, strict=True):
            coefficients[:, at : at + count], exponents[:, at : at + count] = entry.coefficients, entry.exponents
            at += count
        place = np.repeat([(i, k) for i, k, _ in entries], counts, axis=0)
        return Powers(coefficients, exponents, place)

    def take(self, rows: Array) -> CharacteristicMatrix:
        """Return the matrix of the members `rows`."""
        return CharacteristicMatrix(self.system.take(rows))

    def determinant(self, sigma: Complexes) -> Complexes:
        """Return det M̃ at nodes σ, (k,) shared or (b, k) one set a member, as (b, k)."""
        shape = (self.batch, sigma.shape[-1])
        return np.broadcast_to(determinant(self(sigma), shape), shape)


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


def _entries(system: LinearFractionalSystem) -> list[list[Entry | None]]:
    """Collect the terms entry by entry, merging equal shared orders; None where an entry is zero."""
    highest, size = system.highest.tolist(), range(system.size)
    shared: list[list[dict[float, Floats]]] = [[{} for _ in size] for _ in size]
    own: list[list[list[tuple[Floats, Floats]]]] = [[[] for _ in size] for _ in size]
    for number, term in enumerate(system.dynamics):
        for i, k in np.argwhere(term.matrix.any(axis=0) if term.matrix.ndim == 3 else term.matrix).tolist():
            coefficient, order = term.matrix[..., i, k], term.orders[..., k] - highest[k]
            if number and order.max() >= 0.0:
                raise UnsupportedError(unsolved_for_highest(system, "the characteristic equation"))
            if order.ndim == 0:
                known = shared[i][k]
                known[float(order)] = known[float(order)] + coefficient if float(order) in known else coefficient
            else:
                own[i][k].append((coefficient, order))
    return [[_entry(shared[i][k], own[i][k]) for k in size] for i in size]


def _entry(shared: dict[float, Floats], own: list[tuple[Floats, Floats]]) -> Entry | None:
    if not shared and not own:
        return None
    coefficients = [*shared.values(), *(c for c, _ in own)]
    exponents = [*(np.asarray(e) for e in shared), *(e for _, e in own)]
    return Entry(_columns(coefficients), _columns(exponents))


def _columns(values: list[Floats]) -> Floats:
    """Return numbers () and one a member, (b,), as columns, (J,) or (b, J)."""
    batches = [len(value) for value in values if value.ndim]
    if not batches:
        return np.array(values)
    columns = np.empty((max(batches), len(values)))
    for j, value in enumerate(values):
        columns[:, j] = value
    return columns
