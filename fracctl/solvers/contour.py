"""The contour solver: numerical inversion of the Laplace transform for whole batches of loops, with a certificate.

Windows of time, each with a contour of its own (Weideman and Trefethen, Math. Comp. 76 (2007) 1341, give the
hyperbola that `contour_design` departs from), and for every member

- the number of poles right of every contour, by the argument principle;
- the difference of two interlaced quadrature rules on every contour;
- the last Chebyshev coefficients on every panel.

Members that miss the tolerance are solved again with contours beyond their pole radius; members with a pole in the
right half plane are told apart by the argument principle on the imaginary axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Floats, share
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.solvers.base import Survey
from fracctl.solvers.batched import BatchSolver
from fracctl.solvers.contour_loops import loops
from fracctl.solvers.contour_plan import make_plan
from fracctl.solvers.contour_response import responses
from fracctl.solvers.members import Members
from fracctl.solvers.results import packed, without_trajectory

_SMALLEST_TOLERANCE = 1e-12
_SERIES_ORDER, _COUPLED_SERIES_ORDER = 6, 5
"""Highest power of time near 0: coupled coordinates have so many powers that a further window is cheaper."""


@dataclass(frozen=True)
class _Attempt:
    """How contours are laid out: wider and with a finer rule each time."""

    width: float
    """Height of the contours over the bound on the poles' imaginary parts, for a single coordinate."""
    coupled: float
    """The same for several, where the bound is a norm and generous."""
    safety: float
    """Tolerance of the rule over that of the solver."""
    ratio: float
    """Pole radii within this factor share a contour."""


_ATTEMPTS = (_Attempt(1.0, 0.6, 0.05, 1.25), _Attempt(1.1, 1.1, 0.003, 1.5), _Attempt(1.5, 1.5, 0.001, 1.5))


@dataclass(frozen=True)
class _Group:
    """Members that share contours."""

    rows: Array
    radius: float
    shift: float


class Contour(BatchSolver):
    """Inverse Laplace transform on contours that enclose all poles.

    Solves linear loops of second order with linear fractional laws (orders in [-1, 2), auxiliary states), any batch
    of gains; fast where the members share their orders.

    Args:
        tolerance: largest error of positions and controls relative to their peaks, in [1e-11, 1e-3].
        cross_check: share of a survey's rows that the Volterra solver computes too, in [0, 1].

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    name = "contour"
    checked_by = "volterra"
    fewest_shared = 8

    def __init__(self, tolerance: float = 1e-8, cross_check: float = 0.0) -> None:
        if not 1e-11 <= tolerance <= 1e-3:
            raise ArgumentError("tolerance", tolerance, "must lie in [1e-11, 1e-3]")
        self.tolerance, self.cross_check = float(tolerance), share("cross_check", cross_check)

    def _solved(self, members: Members, rows: Array, radius: Floats, shift: Floats) -> Iterator[Survey]:
        """Solve `rows`; those that miss the tolerance again, the last time as they come out."""
        cost = np.zeros(len(radius), dtype=np.int64)
        single = members.system.size == 1
        order = _SERIES_ORDER if single else _COUPLED_SERIES_ORDER
        batch = loops(members.system, members.y0, members.rate, members.every, order)
        for attempt in _ATTEMPTS:
            missed: list[Array] = []
            for group in _classes(rows, radius, shift, attempt.ratio):
                tolerance = max(attempt.safety * self.tolerance, _SMALLEST_TOLERANCE)
                try:
                    hull = group.radius * (attempt.width if single else attempt.coupled)
                    plan = make_plan(members.horizon, hull, group.radius, group.shift, tolerance, order)
                except UnsupportedError:
                    if members.every:
                        raise
                    yield without_trajectory(members.take(group.rows), "failed")
                    continue
                cost[group.rows] += plan.nodes
                for some, response, enclosed in responses(batch, group.rows, plan):
                    good = enclosed & (response.error.max(axis=0) <= self.tolerance)
                    done = good if attempt is not _ATTEMPTS[-1] else np.ones_like(good)
                    missed.append(some[~done])
                    if done.any():
                        part = members.take(some)
                        yield packed(part, response, np.flatnonzero(done), good, cost[some], plan.grid)
            rows = np.concatenate([np.zeros(0, dtype=np.intp), *missed])
            if not rows.size:
                return


def _classes(rows: Array, radius: Floats, shift: Floats, ratio: float) -> Iterator[_Group]:
    """Split rows by shift and by pole radius, rounded up to powers of `ratio`."""
    level = np.ceil(np.log(radius[rows]) / np.log(ratio)).astype(int)
    for a in np.unique(shift[rows]):
        for k in np.unique(level[shift[rows] == a]):
            yield _Group(rows[(shift[rows] == a) & (level == k)], float(ratio**k), float(a))
