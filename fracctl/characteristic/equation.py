"""What is followed to count zeros: the determinant of a block of coordinates, with a limit at the origin.

det M(σ) = det Σ_t c_t σ^β_t has a limit for σ → 0 unless there are integrals, β < 0. With those it is multiplied out
to a sum of powers, one term instead of a matrix, and divided by the lowest power that a member has.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.matrix import CharacteristicMatrix

_VANISHING = 1e-13
"""Size of a limit, relative to what it is computed from, below which it is 0 to rounding."""

_CANCELLED = 1e-15
"""Size of a coefficient, relative to the products that it is the sum of, below which they cancel."""


class Equation(NamedTuple):
    """f(σ) = det Σ_t c_t σ^β_t with β ≥ 0, for b members."""

    coefficients: Floats
    """c, row by row of the matrix, (b, K)."""
    orders: Floats
    """β, (1, K) where members share them, (b, K) otherwise."""
    place: Array
    """Row and column of each power, (K, 2)."""
    degree: Floats
    """f ~ σ^degree at infinity, (1,) or (b,)."""
    limit: Floats
    """f(0), (b,)."""
    sums: Floats
    """Row sums of magnitudes of the matrix at the origin, (b, p)."""
    vanishing: Floats
    """Size below which f(0) is 0 to rounding, (b,)."""
    gone: int | None
    """How many coordinates, the last ones, can be eliminated one by one; None if none need be."""

    def take(self, rows: Array) -> Equation:
        """Return the equation of the members `rows`."""
        own = len(self.orders) > 1
        return Equation(
            self.coefficients[rows],
            self.orders[rows] if own else self.orders,
            self.place,
            self.degree[rows] if own else self.degree,
            self.limit[rows],
            self.sums[rows],
            self.vanishing[rows],
            self.gone,
        )


def equations(matrix: CharacteristicMatrix, block: list[int]) -> Iterator[tuple[Array, Equation]]:
    """Yield members of a batch and the equation of a block of their coordinates.

    Members that share their orders come together unless only some of them have an integral.
    """
    kept, gone = matrix.split(block) if len(block) > 2 else (block, [])
    block = kept + gone
    c, exponents, place = matrix.powers_of(block)
    orders = exponents + matrix.highest[block][place[:, 1]]
    degree, everyone = float(matrix.highest[block].sum()), np.arange(matrix.batch)
    known = _VANISHING * _static_row_sums(matrix)[:, block].prod(axis=1)
    if orders.min() >= 0.0:
        yield everyone, _equation(c, orders, place, np.full(len(orders), degree), known, len(gone) or None)
        return
    c, magnitudes, orders = _multiplied_out(c, orders, place, len(block))
    lowest = np.minimum(np.where(c != 0.0, orders, 0.0).min(axis=1), 0.0)
    groups = [everyone] if len(orders) > 1 else [np.flatnonzero(lowest == value) for value in np.unique(lowest)]
    for rows in groups:
        own = lowest[rows] if len(orders) > 1 else lowest[rows[:1]]
        raised = np.maximum(orders - own[:, None], 0.0)
        computed_from = np.where(raised == 0.0, magnitudes[rows], 0.0).sum(axis=1)
        vanishing = np.where(lowest[rows] < 0.0, _VANISHING * computed_from, known[rows])
        yield rows, _equation(c[rows], raised, np.zeros((c.shape[1], 2), dtype=np.intp), degree - own, vanishing, None)


def _equation(c: Floats, orders: Floats, place: Array, degree: Floats, vanishing: Floats, gone: int | None) -> Equation:
    size = int(place.max()) + 1
    limit = np.zeros((len(c), size, size))
    for t in np.flatnonzero((orders == 0.0).any(axis=0)):
        limit[:, place[t, 0], place[t, 1]] += np.where(orders[:, t] == 0.0, c[:, t], 0.0)
    if size == 1:
        value = limit[:, 0, 0]
    elif size == 2:
        value = limit[:, 0, 0] * limit[:, 1, 1] - limit[:, 0, 1] * limit[:, 1, 0]
    else:
        value = np.linalg.det(limit)
    return Equation(c, orders, place, degree, value, np.abs(limit).sum(axis=2), vanishing, gone)


def _static_row_sums(matrix: CharacteristicMatrix) -> Floats:
    """Return row sums of |A_j| over all terms of order 0, (b, p): det M(0) is known to rounding of their products."""
    sums = np.zeros((matrix.batch, matrix.size))
    for term in matrix.system.dynamics:
        static = term.orders == 0.0
        if static.any():
            sums += (np.abs(term.matrix) * static[..., None, :]).sum(axis=-1)
    return sums


def _multiplied_out(c: Floats, orders: Floats, place: Array, size: int) -> tuple[Floats, Floats, Floats]:
    """Return the determinant as one sum of powers, one for each order; what cancels but for rounding is 0.

    So integrals of fewer combinations than there are coordinates leave no trace of a higher power.

    Returns:
        Coefficients (b, J), their magnitudes before anything cancels, and orders (1, J) or (b, J).
    """
    terms, signs = [], []
    for columns in permutations(range(size)):
        factors = [np.flatnonzero((place == (row, column)).all(axis=1)) for row, column in enumerate(columns)]
        sign = round(float(np.linalg.det(np.eye(size)[list(columns)])))
        for choice in product(*factors):
            terms.append(choice)
            signs.append(sign)
    chosen = np.array(terms)
    products, sums = c[:, chosen].prod(axis=2) * np.array(signs), np.round(orders[:, chosen].sum(axis=2), 12)
    distinct, which = np.unique(sums, axis=1, return_inverse=True)
    together = (which.reshape(-1, 1) == np.arange(distinct.shape[1])).astype(np.float64)
    coefficients, magnitudes = products @ together, np.abs(products) @ together
    return np.where(np.abs(coefficients) > _CANCELLED * magnitudes, coefficients, 0.0), magnitudes, distinct
