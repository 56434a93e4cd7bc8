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

from fracctl.arrays import Array, Booleans, Floats, share
from fracctl.characteristic.bounds import SMALLEST_RADIUS, pole_height
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.poles import principal_poles
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.solvers.base import SolvedMembers
from fracctl.solvers.batched import BatchSolver
from fracctl.solvers.contour.lanes import LANES
from fracctl.solvers.contour.loops import loops
from fracctl.solvers.contour.plan import make_plan
from fracctl.solvers.contour.response import responses
from fracctl.solvers.members import Members
from fracctl.solvers.results import packed, without_trajectory

_SMALLEST_TOLERANCE = 1e-12
_SERIES_ORDER, _COUPLED_SERIES_ORDER = 6, 5
"""Highest power of time near 0: coupled coordinates have so many powers that a further window is cheaper."""


_SPREAD = 2.0
"""Ratios of pole radius and height within this factor share a contour."""
_MANY = 1000.0
"""Imaginary part times horizon from which computing poles takes less time than it saves."""
_CLEAR = 1.02
"""Height of the contours over computed poles."""


@dataclass(frozen=True)
class _Attempt:
    """How contours are laid out: wider and with a finer rule each time."""

    width: float
    """Height of the contours over the bound on the poles' imaginary parts, for a single position."""
    coupled: float
    """The same for several, where the bound is a norm and generous."""
    safety: float
    """Tolerance of the rule over that of the solver."""
    ratio: float
    """Heights within this factor share a contour."""


_ATTEMPTS = (_Attempt(1.0, 0.6, 0.05, 1.25), _Attempt(1.1, 1.1, 0.003, 1.5), _Attempt(1.5, 1.5, 0.001, 1.5))


@dataclass(frozen=True)
class _Group:
    """Members that share contours."""

    rows: Array
    height: float
    """Bound on the imaginary parts of their poles."""
    radius: float
    shift: float
    mixed: bool
    """Whether some only fill a block."""


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

    def _solved(self, members: Members, rows: Array, radius: Floats, shift: Floats) -> Iterator[SolvedMembers]:
        """Solve `rows`; those that miss the tolerance again, the last time as they come out."""
        cost = np.zeros(len(radius), dtype=np.int64)
        single = members.system.n_positions == 1
        order = _SERIES_ORDER if members.system.size == 1 else _COUPLED_SERIES_ORDER
        first = _ATTEMPTS[0].width if single else _ATTEMPTS[0].coupled
        height, known = _heights(members, rows, radius, first)
        batch = loops(members.system, members.y0, members.rate, members.every, order)
        for attempt in _ATTEMPTS:
            last = attempt is _ATTEMPTS[-1]
            missed: list[Array] = []
            tolerance = max(attempt.safety * self.tolerance, _SMALLEST_TOLERANCE)
            bounds = height, radius, shift, attempt.ratio
            groups = list(_classes(rows, *bounds, fill=not (members.every or last)))
            while groups:
                group = groups.pop(0)
                try:
                    hull = group.height * (attempt.width if single else attempt.coupled)
                    plan = make_plan(members.horizon, hull, group.radius, group.shift, tolerance, order)
                except UnsupportedError:
                    if members.every:
                        raise
                    if group.mixed:
                        groups += _classes(group.rows, *bounds, fill=False)
                        continue
                    yield without_trajectory(members.take(group.rows), "failed")
                    continue
                cost[group.rows] += plan.nodes
                for some, response, enclosed in responses(batch, group.rows, plan):
                    good = (enclosed | known[some]) & (response.error.max(axis=0) <= self.tolerance)
                    done = good if not last else np.ones_like(good)
                    missed.append(some[~done])
                    if done.any():
                        part = members.take(some)
                        yield packed(part, response, np.flatnonzero(done), good, cost[some], plan.grid)
            rows = np.concatenate([np.zeros(0, dtype=np.intp), *missed])
            if not rows.size:
                return


def _heights(members: Members, rows: Array, radius: Floats, width: float) -> tuple[Floats, Booleans]:
    """Return bounds on the imaginary parts of poles over the `width` of the first contours, and which are exact, (b,).

    Where the quick bound asks for many nodes, as the pole radius of an overdamped loop does, all poles are computed.
    Then contours enclose them by design, also where nodes are too far apart to count a pole next to the cut.
    """
    matrix = CharacteristicMatrix(members.system)
    height, known = pole_height(matrix, radius).copy(), np.zeros(len(radius), dtype=np.bool_)
    for row in rows[width * height[rows] * members.horizon > _MANY]:
        poles, known[row] = principal_poles(matrix.take(np.array([row])))
        if known[row]:
            height[row] = max(_CLEAR * float(np.abs(poles.imag).max(initial=0.0)) / width, SMALLEST_RADIUS)
    return height, known


def _classes(rows: Array, height: Floats, radius: Floats, shift: Floats, ratio: float, fill: bool) -> Iterator[_Group]:
    """Split rows by shift and by height and radius of their poles, rounded up to powers of `ratio` and of `_SPREAD`.

    Those with the most nodes come first. With `fill`, for members with one shift, the next ones fill the places that
    they leave empty in a block of members, which costs nothing but the last digits.
    """
    level = np.ceil(np.log(height[rows]) / np.log(ratio))
    spread = np.ceil(np.log(radius[rows] / height[rows]) / np.log(_SPREAD))
    order = np.lexsort((-spread, -level, shift[rows]))
    rows, level, spread = rows[order], level[order], spread[order]
    steps = np.flatnonzero(np.diff(np.stack([shift[rows], level, spread])).any(axis=0)) + 1
    first = 0
    while first < len(rows):
        alike = stop = next((int(step) for step in steps if step > first), len(rows))
        if fill:
            stop = min(first + -(-(alike - first) // LANES) * LANES, len(rows))
        heights = ratio ** level[first:stop]
        radii = heights * _SPREAD ** spread[first:stop]
        some = np.sort(rows[first:stop])
        yield _Group(some, float(heights.max()), float(radii.max()), float(shift[some[0]]), stop > alike)
        first = stop
