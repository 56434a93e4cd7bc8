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
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.winding import abscissa_bound, unstable_zeros
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.loop import ClosedLoop
from fracctl.solvers.base import Survey
from fracctl.solvers.contour_plan import make_plan
from fracctl.solvers.contour_response import respond
from fracctl.solvers.contour_results import Members, merged, packed, without_trajectory
from fracctl.trajectory import Trajectory

_CHUNK = 1536
"""Trajectories solved at once: their transforms stay in the cache."""
_LARGEST_GROWTH = 200.0
"""Exponent of growth over the horizon beyond which an unstable trajectory is given up as diverged."""
_FEWEST_SHARED = 8
"""Members with equal orders that are worth a group of their own."""
_SMALLEST_TOLERANCE = 1e-12


@dataclass(frozen=True)
class _Attempt:
    """How contours are laid out: wider and with a finer rule each time."""

    width: float
    """Height of the contours over the bound on the poles' imaginary parts."""
    safety: float
    """Tolerance of the rule over that of the solver."""
    ratio: float
    """Pole radii within this factor share a contour."""


_ATTEMPTS = (_Attempt(1.0, 0.03, 1.25), _Attempt(1.1, 0.003, 1.5), _Attempt(1.5, 0.001, 1.5))


@dataclass(frozen=True)
class _Group:
    """Members that share contours."""

    rows: Array
    radius: float
    shift: float


class Contour:
    """Inverse Laplace transform on contours that enclose all poles.

    Solves linear loops of second order with linear fractional laws (orders in [-1, 2], auxiliary states), any batch
    of gains; fast where the members share their orders.

    Args:
        tolerance: largest error of positions and controls relative to their peaks, in [1e-11, 1e-3].

    Raises:
        ArgumentError: the tolerance lies outside its range.
    """

    name = "contour"

    def __init__(self, tolerance: float = 1e-8) -> None:
        if not 1e-11 <= tolerance <= 1e-3:
            raise ArgumentError("tolerance", tolerance, "must lie in [1e-11, 1e-3]")
        self.tolerance = float(tolerance)

    def supports(self, loop: ClosedLoop) -> str | None:
        """Return None for a linear fractional loop, otherwise why it is refused and what to use instead."""
        if isinstance(getattr(loop, "system", None), LinearFractionalSystem):
            return None
        return "the contour solver takes linear loops only; use 'method_of_steps' for nonlinear or delayed ones"

    def solve(self, loop: ClosedLoop, initial_state: ArrayLike, horizon: float) -> Trajectory:
        """Return the trajectories of all members on one grid.

        Args:
            loop: the closed loop, of b members or a single one.
            initial_state: [ξ(0), ξ'(0)], (n,), or (b, n) one a member.
            horizon: S > 0, the last time.

        Raises:
            ArgumentError: a shape does not fit, or the horizon is not positive.
            UnsupportedError: poles times horizon are too large, or orders too near the highest.
        """
        state = finite("initial_state", initial_state)
        y0, rate = loop.initial_values(state)
        batch = _common_batch(loop.batch, len(state) if state.ndim == 2 else None)
        system = replace(loop.system, batch=batch)
        y0, rate = (np.broadcast_to(v, (1, batch, v.shape[-1])) for v in (y0, rate))
        parts = list(self._groups(Members(system, y0, rate, _positive("horizon", horizon), every=True)))
        return replace(merged(parts, batch), batched=loop.batch is not None or state.ndim == 2)

    def survey(self, loop: ClosedLoop, initial_states: ArrayLike, horizon: float) -> Iterator[Survey]:
        """Yield members group by group, each from all k initial states (k, n); unstable ones without trajectory."""
        y0, rate = loop.initial_values(np.atleast_2d(finite("initial_states", initial_states)))
        system = replace(loop.system, batch=loop.batch or 1)
        yield from self._groups(Members(system, y0[:, None], rate[:, None], _positive("horizon", horizon), every=False))

    def _groups(self, everyone: Members) -> Iterator[Survey]:
        """Split the members by orders, tell the unstable apart and solve the rest."""
        for which in _equal_orders(everyone.system):
            members = everyone.take(which)
            matrix = CharacteristicMatrix(members.system)
            zeros, marginal = unstable_zeros(matrix)
            stable = (zeros == 0.0).astype(object)
            stable[marginal] = None
            members = replace(members, stable=stable)
            unstable = ~marginal & (zeros > 0.0)
            shift = np.zeros(len(which))
            if members.every and unstable.any():
                shift[unstable] = _growth(matrix.take(np.flatnonzero(unstable)), members.horizon)
            given_up = shift * members.horizon > _LARGEST_GROWTH if members.every else unstable
            if given_up.any():
                word = "diverged" if members.every else "unstable"
                yield without_trajectory(members.take(np.flatnonzero(given_up)), word)
            yield from self._solved(members, np.flatnonzero(~given_up), pole_radius(matrix), shift)

    def _solved(self, members: Members, rows: Array, radius: Floats, shift: Floats) -> Iterator[Survey]:
        """Solve `rows`; those that miss the tolerance again, the last time as they come out."""
        cost = np.zeros(len(radius), dtype=np.int64)
        for attempt in _ATTEMPTS:
            missed: list[Array] = []
            for group in _classes(rows, radius, shift, attempt.ratio, max(_CHUNK // len(members.y0), 1)):
                tolerance = max(attempt.safety * self.tolerance, _SMALLEST_TOLERANCE)
                try:
                    hull = attempt.width * group.radius
                    plan = make_plan(members.horizon, hull, group.radius, group.shift, tolerance)
                except UnsupportedError:
                    if members.every:
                        raise
                    yield without_trajectory(members.take(group.rows), "failed")
                    continue
                cost[group.rows] += plan.nodes
                part = members.take(group.rows)
                response = respond(part.system, part.y0, part.rate, plan, part.every)
                good = response.enclosed & (response.error.max(axis=0) <= self.tolerance)
                done = good if attempt is not _ATTEMPTS[-1] else np.ones_like(good)
                missed.append(group.rows[~done])
                if done.any():
                    yield packed(part, response, np.flatnonzero(done), good, cost[group.rows], plan.grid)
            rows = np.concatenate([np.zeros(0, dtype=np.intp), *missed])
            if not rows.size:
                return


def _common_batch(loop: int | None, states: int | None) -> int:
    sizes = {size for size in (loop, states) if size is not None and size != 1}
    if len(sizes) > 1:
        allowed = f"must have the batch size of the loop, {loop}"
        raise ArgumentError("initial_state", f"a batch of {states}", allowed)
    return sizes.pop() if sizes else 1


def _positive(name: str, value: float) -> float:
    number = float(finite(name, value))
    if number <= 0.0:
        raise ArgumentError(name, number, "must be positive")
    return number


def _growth(matrix: CharacteristicMatrix, horizon: float) -> Floats:
    """Bound the real parts of the poles from above, rounded to whole multiples of 1/horizon."""
    growth: Floats = np.ceil(abscissa_bound(matrix, 1.0 / horizon) * horizon) / horizon
    return growth


def _equal_orders(system: LinearFractionalSystem) -> Iterator[Array]:
    """Yield groups of members: those that share all orders, or together where too few do."""
    batch = system.batch or 1
    own = [term.orders for term in system.dynamics if term.orders.ndim == 2]
    if not own:
        yield np.arange(batch)
        return
    table = np.concatenate([np.broadcast_to(o, (batch, o.shape[-1])) for o in own], axis=1)
    _, which = np.unique(table, axis=0, return_inverse=True)
    which = which.ravel()
    counts = np.bincount(which)
    few = counts[which] < _FEWEST_SHARED
    if few.any():
        yield np.flatnonzero(few)
    for value in np.flatnonzero(counts >= _FEWEST_SHARED):
        yield np.flatnonzero(which == value)


def _classes(rows: Array, radius: Floats, shift: Floats, ratio: float, chunk: int) -> Iterator[_Group]:
    """Split rows by shift and by pole radius, rounded up to powers of `ratio`, into chunks."""
    level = np.ceil(np.log(radius[rows]) / np.log(ratio)).astype(int)
    for a in np.unique(shift[rows]):
        for k in np.unique(level[shift[rows] == a]):
            group = rows[(shift[rows] == a) & (level == k)]
            for start in range(0, len(group), chunk):
                yield _Group(group[start : start + chunk], float(ratio**k), float(a))
