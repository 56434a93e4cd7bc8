"""A controller on board: a linear discrete state space that is told measurements and answers with controls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import block_array, csr_array

from fracctl.arrays import Array, Complexes, Floats
from fracctl.compiling import compiled_with
from fracctl.sampled.operators import Sparse, substituted


@dataclass(frozen=True)
class DiscreteController:
    """The controller in units of its plant.

        x_{k+1} = A x_k + B y_k,        u_k = C x_k + D y_k,        x_0 = E y_0,        y = [ξ, ξ']

    x_0 is the memory that begins at y_0. A is lower triangular.
    """

    a: Sparse
    """A, (n, n)."""
    b: Floats
    """B, (n, 2m)."""
    c: Floats
    """C, (m, n)."""
    d: Floats
    """D, (m, 2m)."""
    e: Floats
    """E, (n, 2m)."""
    integral_of: Array
    """Number of the position whose integral a state belongs to, which anti-windup may hold, (n,); -1 for others."""
    period: float
    """T_s, dimensionless."""
    delay: float
    """Time from a measurement to the control that answers it, in periods."""

    @property
    def n_states(self) -> int:
        """Number n of states."""
        return len(self.b)

    @property
    def n_controls(self) -> int:
        """Number m of controls."""
        return len(self.c)

    @cached_property
    def rows(self) -> Rows:
        """[A B; C D] without its zeros."""
        return Rows.of(csr_array(block_array([[self.a, csr_array(self.b)], [csr_array(self.c), csr_array(self.d)]])))

    @property
    def operations(self) -> int:
        """Multiply-adds a step: entries of [A B; C D] but for rows that only pass a number on."""
        return self.rows.operations

    def start(self, measured: Floats, earlier: Floats | None = None) -> Floats:
        """Return the states with which a memory begins, (b, n).

        Args:
            measured: y at switch-on, (b, 2m).
            earlier: recorded samples before, (b, k, 2m), the last one a period before; None for none.
        """
        if earlier is None or not earlier.shape[1]:
            return measured @ self.e.T
        states = earlier[:, 0] @ self.e.T
        for k in range(earlier.shape[1]):
            states, _ = self.step(states, np.ascontiguousarray(earlier[:, k]))
        return states

    def step(self, states: Floats, measured: Floats) -> tuple[Floats, Floats]:
        """Return the next states (b, n) and the controls (b, m) of states and measurements (b, 2m)."""
        following, control = np.empty(states.shape), np.empty((len(states), self.n_controls))
        rows = self.rows
        multiply(rows.first, rows.column, rows.value, states, measured, following, control)
        return following, control

    def response(self, phase: Floats) -> Complexes:
        """Return D + C (z I - A)⁻¹ B at z = exp(i phase), phase = ω T_s (k,), (k, m, 2m)."""
        through = substituted(self.a, self.b, np.exp(1j * phase))
        value: Complexes = self.d + np.tensordot(self.c, through, axes=(1, 1)).transpose(1, 0, 2)
        return value


@dataclass(frozen=True)
class Rows:
    """A matrix by its rows, without zeros (CSR)."""

    first: Array
    """Where each row begins, and the end, (r + 1,)."""
    column: Array
    value: Floats

    @classmethod
    def of(cls, matrix: Sparse) -> Rows:
        """Return the rows of a matrix."""
        rows = matrix.copy()
        rows.eliminate_zeros()
        rows.sort_indices()
        return cls(rows.indptr.astype(np.int64), rows.indices.astype(np.int64), rows.data)

    @property
    def operations(self) -> int:
        """Number of entries, but for rows that hold a single 1."""
        counts = np.diff(self.first)
        alone = np.flatnonzero(counts == 1)
        return int(counts.sum() - (self.value[self.first[alone]] == 1.0).sum())


@compiled_with(error_model="numpy")
def multiply(
    first: Array, column: Array, value: Floats, states: Floats, measured: Floats, following: Floats, control: Floats
) -> None:
    """Write [x_{k+1}, u_k] = rows · [x_k, y_k] of all members."""
    n = states.shape[1]
    for i in range(len(states)):
        for r in range(len(first) - 1):
            total = 0.0
            for j in range(first[r], first[r + 1]):
                at = column[j]
                total += value[j] * (states[i, at] if at < n else measured[i, at - n])
            if r < n:
                following[i, r] = total
            else:
                control[i, r - n] = total
