"""A linear fractional system of equations, as data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.fractional.terms import FractionalTerm


@dataclass(frozen=True)
class LinearFractionalSystem:
    """Σ_j A_j D^{β_j} y = 0 with y = [ξ, z], and the control υ = Σ_j C_j D^{γ_j} y.

    ξ are m positions (highest order 2), z are q auxiliary states (highest order 1); the highest-order matrix is
    the identity. The state is [ξ, ξ', z] with n = 2m + q entries.
    """

    n_positions: int
    """m."""
    n_auxiliary: int
    """q."""
    dynamics: tuple[FractionalTerm, ...]
    """Terms A_j D^{β_j}, matrices (m+q, m+q) or (b, m+q, m+q)."""
    control: tuple[FractionalTerm, ...]
    """Terms C_j D^{γ_j}, matrices (m, m+q) or (b, m, m+q)."""
    auxiliary_initial: Floats
    """z(0), (q,)."""
    batch: int | None
    """Batch size b, None for a single loop."""

    @property
    def highest(self) -> Floats:
        """Highest order ℓ of each coordinate, (m+q,): 2 for positions, 1 for auxiliary states."""
        return np.array([2.0] * self.n_positions + [1.0] * self.n_auxiliary)

    @property
    def size(self) -> int:
        """p = m + q, the number of coordinates y."""
        return self.n_positions + self.n_auxiliary

    def take(self, rows: Array) -> LinearFractionalSystem:
        """Return the members `rows` of the batch, as a batch."""
        if self.batch == len(rows) and np.array_equal(rows, np.arange(len(rows))):
            return self
        return LinearFractionalSystem(
            self.n_positions,
            self.n_auxiliary,
            tuple(term.take(rows) for term in self.dynamics),
            tuple(term.take(rows) for term in self.control),
            self.auxiliary_initial,
            len(rows),
        )


def order_margin(system: LinearFractionalSystem) -> float:
    """Return by how much, at least, the orders of all terms but the first lie below the highest of their column."""
    margins = [
        float(np.min((system.highest - term.orders)[..., used]))
        for term in system.dynamics[1:]
        if np.any(used := term.matrix.reshape(-1, system.size).any(axis=0))
    ]
    return min(margins, default=np.inf)


def unsolved_for_highest(system: LinearFractionalSystem, taker: str) -> str | None:
    """Return why `taker` refuses a system with a term of the highest order of its column, or None."""
    margin = order_margin(system)
    if margin > 0.0:
        return None
    found = "of that order" if margin == 0.0 else f"{-margin:g} above it"
    return (
        f"{taker} takes terms of an order below the highest of their coordinate (2 for positions, 1 for auxiliary"
        f" states), but one is {found}; solve the equation for its highest derivatives"
    )
