"""Fractional Chebyshev collocation: the solution as one polynomial over the horizon, as the literature has it.

Yaylali, Butcher and Sinclair solve their loops this way, after Dabiri and Butcher (Nonlinear Dyn. 90 (2017) 185). The
solution is no polynomial: where y'(0) is not 0 it has a power t^e, e = 3 - α for a term of order α, and the error
decreases as N^(-2(e-1)) only. `Contour` and `Volterra` have no such limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fracctl.arrays import Array, Floats, share
from fracctl.errors import ArgumentError
from fracctl.fractional.collocation import derivative_matrix, power_derivative
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.panels import PanelGrid
from fracctl.solvers.base import SolvedMembers
from fracctl.solvers.batched import BatchSolver
from fracctl.solvers.collocation.equations import FORMS, Equations
from fracctl.solvers.members import Members, whole
from fracctl.solvers.outputs import Derivative, Values, values
from fracctl.solvers.results import packed
from fracctl.solvers.sampling import FIRST_TIME, graded_panels

_FEWEST_NODES = 4
_MOST_NODES = 1024
_ACCURACY = 1e-10
"""Of the grid on which the polynomial is handed out."""
_ROUNDING = 4.0 * np.finfo(float).eps
_LARGEST_CHUNK = 4_000_000
"""Entries of the matrices that are solved at once."""


class Collocation(BatchSolver):
    """Chebyshev-Gauss-Lobatto collocation with stable fractional differentiation matrices.

    Solves linear loops with terms of orders in [-1, 2) (below 1 of auxiliary states). The error of a polynomial of
    degree N is estimated by twice its difference from that of degree N/2, whose error is larger; rounding at the end of
    a growing solution, the largest value there is, counts as an error of its initial values.

    Args:
        nodes: N, degree of the polynomial: the points of collocation besides the one at 0, from 4 to 1024.
        form: ``second_order`` collocates ξ'' = …, ``first_order`` the equations of ξ' and of its rate, as two
            polynomials of twice as many values.
        tolerance: largest error relative to the peaks of positions and controls with which a member is ``ok``.
        cross_check: share of a survey's rows that the contour solver computes too, in [0, 1].

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    name = "collocation"

    def __init__(
        self, nodes: int = 128, form: str = "second_order", tolerance: float = 1e-2, cross_check: float = 0.0
    ) -> None:
        self.nodes = whole("nodes", nodes, _FEWEST_NODES, _MOST_NODES)
        if form not in FORMS:
            raise ArgumentError("form", repr(form), f"must be one of {FORMS}")
        if not 0.0 < tolerance < 1.0:
            raise ArgumentError("tolerance", tolerance, "must lie in (0, 1)")
        self.form, self.tolerance, self.cross_check = form, float(tolerance), share("cross_check", cross_check)

    def _solved(self, members: Members, rows: Array, radius: Floats, shift: Floats) -> Iterator[SolvedMembers]:
        del radius
        k, unknowns = len(members.y0), 2 * members.system.size * (self.nodes + 1)
        chunk = max(_LARGEST_CHUNK // (unknowns * (unknowns + 8 * k)), 1)
        for start in range(0, len(rows), chunk):
            part = members.take(rows[start : start + chunk])
            grid = _grid(part.horizon, self.nodes)
            with np.errstate(over="ignore", invalid="ignore"):
                response = self._values(part, grid)
            growth = np.exp(shift[rows[start : start + chunk]] * part.horizon)
            response = replace(response, error=np.maximum(response.error, _ROUNDING * growth))
            good = response.error.max(axis=0) <= self.tolerance
            cost = np.full(len(good), self.nodes + self.nodes // 2)
            yield packed(part, response, np.arange(len(good)), good, cost, grid)

    def _values(self, members: Members, grid: PanelGrid) -> Values:
        system, horizon = members.system, members.horizon
        times = np.concatenate([[0.0], grid.times])
        fine, coarse = (
            _Polynomials.solved(system, members.y0, members.rate, horizon, degree, self.form).at(times)
            for degree in (self.nodes, self.nodes // 2)
        )
        return values(system, fine, coarse, members.every)


@dataclass(frozen=True)
class _Polynomials:
    """y = y(0) + y'(0) t + r with polynomials r on [0, S]."""

    y0: Floats
    """y(0), (k, b, p)."""
    rate: Floats
    """y'(0), (k, b, p)."""
    rest: Floats
    """r at the nodes, (k, b, p, N + 1)."""
    horizon: float

    @classmethod
    def solved(
        cls, system: LinearFractionalSystem, y0: Floats, rate: Floats, horizon: float, degree: int, form: str
    ) -> _Polynomials:
        """Solve the equations of collocation from y(0), y'(0), each (k, b, p) or (k, 1, p)."""
        shape = (len(y0), system.batch or 1, system.size)
        y0, rate = np.broadcast_to(y0, shape), np.broadcast_to(rate, shape)
        return cls(y0, rate, Equations(system, horizon, degree, form).solve(y0, rate), horizon)

    def at(self, times: Floats) -> Derivative:
        """Return D^order of a coordinate as a function, at times (t,) in [0, S]."""

        def derivative(component: int, order: float) -> Floats:
            matrix = _sampling(self.rest.shape[-1], order, (times / self.horizon).tobytes())
            rest = (self.rest[:, :, component] * self.horizon**-order) @ matrix
            powers = [power_derivative(e, order, times) for e in (0.0, 1.0)]
            total: Floats = (
                rest + self.y0[..., component, None] * powers[0] + self.rate[..., component, None] * powers[1]
            )
            return total

        return derivative


@lru_cache(maxsize=32)
def _sampling(n: int, order: float, points: bytes) -> Floats:
    """Return the matrix of D^order from n nodes to points, (n, t), to be applied from the right."""
    return np.ascontiguousarray(derivative_matrix(n, order, np.frombuffer(points)).T)


@lru_cache(maxsize=16)
def _grid(horizon: float, degree: int) -> PanelGrid:
    """Return a grid that resolves polynomials of a degree, and powers of time times polynomials."""

    def waves(start: float, end: float) -> float:
        first, last = (np.arcsin(np.sqrt(t / horizon)) for t in (start, end))
        return degree * float(last - first)

    edge = 0.25 * horizon / degree**2
    return PanelGrid(graded_panels(FIRST_TIME * horizon, edge, horizon, waves, _ACCURACY))
