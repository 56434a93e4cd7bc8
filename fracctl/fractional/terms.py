"""Linear fractional terms: matrices and orders of differentiation, as data.

A linear fractional system in the coordinates y = [ξ, z] (positions, auxiliary states) is

    Σ_j A_j D^{β_j} y = 0,        υ = Σ_j C_j D^{γ_j} y,

with one order a column and D^β the Caputo derivative from 0 for β > 0, the Riemann-Liouville integral for β < 0.
PD, PD^α, PDD^α, PI^λD^μ and filters with states of their own are all of this form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Complexes, Floats
from fracctl.errors import ArgumentError

LOWEST_ORDER, HIGHEST_ORDER = -1.0, 2.0


@dataclass(frozen=True)
class FractionalTerm:
    """G D^β y: matrix G, (r, p) or (b, r, p), and one order β in [-1, 2] a column, (p,) or (b, p)."""

    matrix: Floats
    """G, dimensionless, (r, p) or (b, r, p)."""
    orders: Floats
    """β, (p,) or (b, p)."""

    def __post_init__(self) -> None:
        lowest, highest = self.orders.min(initial=0.0), self.orders.max(initial=0.0)
        if lowest < LOWEST_ORDER or highest > HIGHEST_ORDER:
            allowed = f"must lie in [{LOWEST_ORDER:g}, {HIGHEST_ORDER:g}]"
            raise ArgumentError("orders", lowest if lowest < LOWEST_ORDER else highest, allowed)
        if self.matrix.shape[-1] != self.orders.shape[-1]:
            allowed = f"must have one order for each of the {self.matrix.shape[-1]} columns of `matrix`"
            raise ArgumentError("orders", f"of shape {self.orders.shape}", allowed)

    @property
    def batch(self) -> int | None:
        """Batch size, None where neither matrix nor orders carry a batch axis."""
        sizes = [self.matrix.shape[0]] if self.matrix.ndim == 3 else []
        sizes += [self.orders.shape[0]] if self.orders.ndim == 2 else []
        return max(sizes) if sizes else None

    def take(self, rows: np.ndarray) -> FractionalTerm:
        """Return the members `rows` of the batch."""
        matrix = self.matrix.take(rows, axis=0) if self.matrix.ndim == 3 and self.matrix.shape[0] > 1 else self.matrix
        orders = self.orders[rows] if self.orders.ndim == 2 and self.orders.shape[0] > 1 else self.orders
        return FractionalTerm(matrix, orders)


def powers(sigma: Complexes, orders: Floats) -> Complexes:
    """Return σ^β on the principal sheet, shape (…orders, k) for nodes σ (k,); integer orders without a logarithm."""
    logarithm = np.log(sigma)
    values = np.exp(orders[..., None] * logarithm)
    for integer in (-1.0, 0.0, 1.0, 2.0):
        where = orders == integer
        if np.any(where):
            values[where] = sigma**integer
    return values


def turned(orders: Floats) -> Complexes:
    """Return i^β, exact for whole orders."""
    whole = np.rint(orders)
    exact = np.array([1.0, 1j, -1.0, -1j])[whole.astype(int) % 4]
    values: Complexes = np.where(orders == whole, exact, np.exp(0.5j * np.pi * orders))
    return values
