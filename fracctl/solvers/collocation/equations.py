"""The linear equations of fractional Chebyshev collocation, for batches of loops with shared orders."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracctl.arrays import Floats
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.fractional.collocation import chebyshev_nodes, derivative_matrix, power_derivative
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.solvers.blocks import Term, assembled, solve_each, terms_of

FORMS = ("second_order", "first_order")


class Equations:
    """M r = right-hand side for r = y - y(0) - y'(0) t at the nodes of [0, S] but the first.

    Second-order form: D² r_i + … at all nodes but the first and the last, which gives way to r_i'(0) = 0. (To leave
    out the node next to 0 instead makes the error three times as large.) First-order form: one more polynomial s_i for
    the rate of each position, r_i' - s_i = 0 and D s_i + … at all nodes but the first. Auxiliary states are of first
    order in both.

    Args:
        system: loops that share their orders.
        horizon: S.
        degree: N.
        form: ``second_order`` or ``first_order``.
    """

    def __init__(self, system: LinearFractionalSystem, horizon: float, degree: int, form: str) -> None:
        self.system, self.horizon, self.degree = system, horizon, degree
        self.first_order = form == "first_order"
        matrix = CharacteristicMatrix(system)
        self.blocks = matrix.blocks()
        self.terms = list(terms_of(matrix))

    def solve(self, y0: Floats, rate: Floats) -> Floats:
        """Return r at all nodes, (k, b, p, N + 1), for y(0) and y'(0), each (k, b, p)."""
        k, b, p = y0.shape
        n = self.degree
        rest = np.zeros((k, b, p, n + 1))
        for block in self.blocks:
            terms = [term for term in self.terms if term.row in block]
            unknowns = [*block, *(p + i for i in block if self._is_split(i))]
            left = self._matrix(terms, unknowns)
            right = np.zeros((b, len(unknowns), n, k))
            for i in block:
                place = unknowns.index(p + i if self._is_split(i) else i)
                right[:, place] = np.moveaxis(self._right_hand_side(terms, i, y0, rate), 0, -1)
            solution = solve_each(left, right.reshape(b, -1, k)).reshape(b, len(unknowns), n, k)
            for place, i in enumerate(block):
                rest[:, :, i, 1:] = np.moveaxis(solution[:, place], -1, 0)
        return rest

    def _is_split(self, coordinate: int) -> bool:
        return self.first_order and coordinate < self.system.n_positions

    def _constrained(self, coordinate: int) -> bool:
        """Whether the last equation of a coordinate is r'(0) = 0."""
        return not self.first_order and coordinate < self.system.n_positions

    def _matrix(self, terms: list[Term], unknowns: list[int]) -> Floats:
        """Return M, (b, U N, U N)."""
        n = self.degree
        matrix = assembled(list(self._in_form(terms)), unknowns, self.system.batch or 1, n, self._derivative)
        for place, unknown in enumerate(unknowns):
            if unknown < self.system.size and self._constrained(unknown):
                last = (place + 1) * n - 1
                matrix[:, last] = 0.0
                matrix[:, last, place * n : (place + 1) * n] = chebyshev_nodes(n + 1).slope[0, 1:] / self.horizon
        return matrix

    def _in_form(self, terms: list[Term]) -> Iterator[Term]:
        """Yield the terms of the equations that are collocated."""
        p = self.system.size
        for term in terms:
            row = p + term.row if self._is_split(term.row) else term.row
            if self._is_split(term.column) and term.order >= 1.0:
                yield Term(row, p + term.column, term.order - 1.0, term.coefficient)
            else:
                yield Term(row, term.column, term.order, term.coefficient)
        for i in {term.row for term in terms if self._is_split(term.row)}:
            yield Term(i, i, 1.0, np.ones(()))
            yield Term(i, p + i, 0.0, -np.ones(()))

    def _derivative(self, term: Term) -> Floats:
        matrix: Floats = derivative_matrix(self.degree + 1, term.order)[1:, 1:] * self.horizon**-term.order
        return matrix

    def _right_hand_side(self, terms: list[Term], row: int, y0: Floats, rate: Floats) -> Floats:
        """Return -Σ A D^β (y(0) + y'(0) t) at the nodes, (k, b, N)."""
        times = chebyshev_nodes(self.degree + 1).t[1:] * self.horizon
        total = np.zeros((*y0.shape[:2], self.degree))
        for term in terms:
            if term.row == row:
                for exponent, start in ((0.0, y0), (1.0, rate)):
                    powers = power_derivative(exponent, term.order, times)
                    total -= (term.coefficient * start[..., term.column])[..., None] * powers
        if self._constrained(row):
            total[..., -1] = 0.0
        return total
