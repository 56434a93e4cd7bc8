"""The contour solver: numerical inversion of the Laplace transform for whole batches of loops, with a certificate.

Windows of time, each with a contour of its own (Weideman and Trefethen, Math. Comp. 76 (2007) 1341, gives the
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

from fracctl.arrays import Array, Booleans, Floats, finite
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.winding import abscissa_bound, unstable_zeros
from fracctl.errors import ArgumentError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop
from fracctl.panels import PanelGrid
from fracctl.solvers.base import Survey
from fracctl.solvers.contour_plan import make_plan
from fracctl.solvers.contour_response import Response, respond
from fracctl.trajectory import Trajectory

_FIRST_HULL = 1.0
"""First guess of the largest imaginary part of poles, relative to the pole radius."""
_CHUNK = 1024
_LARGEST_GROWTH = 200.0
"""Exponent of growth over the horizon beyond which an unstable trajectory is given up as diverged."""


@dataclass(frozen=True)
class _Group:
    """Members with the same orders and the same contours."""

    rows: Array
    hull: float
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
        """
        state = finite("initial_state", initial_state)
        y0, rate = loop.initial_values(state)
        batch = max(loop.batch or 1, len(y0) if y0.ndim == 2 else 1)
        system = _with_batch(loop.system, batch)
        y0, rate = (np.broadcast_to(v, (1, batch, v.shape[-1])) for v in (y0, rate))
        parts = list(self._groups(system, y0, rate, _positive("horizon", horizon), every=True))
        batched = loop.batch is not None or state.ndim == 2
        return replace(_merged(parts, batch), batched=batched)

    def survey(self, loop: ClosedLoop, initial_states: ArrayLike, horizon: float) -> Iterator[Survey]:
        """Yield members group by group, each from all k initial states (k, n); unstable ones without trajectory."""
        y0, rate = loop.initial_values(np.atleast_2d(finite("initial_states", initial_states)))
        system = _with_batch(loop.system, loop.batch or 1)
        yield from self._groups(system, y0[:, None], rate[:, None], _positive("horizon", horizon), every=False)

    def _groups(
        self, system: LinearFractionalSystem, y0: Floats, rate: Floats, horizon: float, every: bool
    ) -> Iterator[Survey]:
        for members in _equal_orders(system):
            part = _shared_orders(system.take(members))
            matrix = CharacteristicMatrix(part)
            zeros, marginal = unstable_zeros(matrix)
            stable = np.where(marginal, None, zeros == 0.0)
            radius = pole_radius(matrix)
            shift = np.zeros(len(members))
            unstable = np.flatnonzero(~marginal & (zeros > 0.0))
            if unstable.size and every:
                bound = abscissa_bound(matrix.take(unstable), 1.0 / horizon)
                shift[unstable] = np.ceil(bound * horizon) / horizon
            given_up = shift * horizon > _LARGEST_GROWTH
            if not every:
                given_up[unstable] = True
            if given_up.any():
                rows = np.flatnonzero(given_up)
                yield _without_trajectory(members[rows], stable[rows], y0, rate, system, horizon, every)
            solve = np.flatnonzero(~given_up)
            for survey in self._solved(part, solve, radius, shift, stable, y0, rate, members, horizon, every):
                yield survey

    def _solved(
        self,
        system: LinearFractionalSystem,
        rows: Array,
        radius: Floats,
        shift: Floats,
        stable: Array,
        y0: Floats,
        rate: Floats,
        members: Array,
        horizon: float,
        with_rates: bool,
    ) -> Iterator[Survey]:
        """Solve `rows`, those that miss the tolerance again with a wider hull, the third time as they come out."""
        cost = np.zeros(len(members), dtype=np.int64)
        for attempt, (width, safety) in enumerate([(_FIRST_HULL, 0.03), (1.1, 0.003), (1.5, 0.001)]):
            missed: list[Array] = []
            for group in _hull_classes(rows, radius, shift, width, 1.5 if attempt else 1.25):
                plan = make_plan(horizon, group.hull, group.radius, group.shift, max(safety * self.tolerance, 1e-12))
                cost[group.rows] += plan.nodes
                pick = members[group.rows] if y0.shape[1] > 1 else slice(None)
                response = respond(system.take(group.rows), y0[:, pick], rate[:, pick], plan, with_rates)
                good = response.enclosed & (response.error.max(axis=0) <= self.tolerance)
                done = good if attempt < 2 else np.ones_like(good)
                if not done.all():
                    missed.append(group.rows[~done])
                if done.any():
                    chosen = np.flatnonzero(done)
                    which = group.rows[chosen]
                    yield _packed(
                        response, chosen, members[which], stable[which], good[chosen], cost[which], plan.grid, y0[:, pick], rate[:, pick]
                    )
            if not missed:
                return
            rows = np.concatenate(missed)


def _positive(name: str, value: float) -> float:
    number = float(finite(name, value))
    if number <= 0.0:
        raise ArgumentError(name, number, "must be positive")
    return number


def _with_batch(system: LinearFractionalSystem, batch: int) -> LinearFractionalSystem:
    return replace(system, batch=batch)


def _equal_orders(system: LinearFractionalSystem) -> Iterator[Array]:
    """Yield groups of members: those that share all orders, or all together where too few would."""
    own = [term.orders for term in system.dynamics if term.orders.ndim == 2]
    batch = system.batch or 1
    everyone = np.arange(batch)
    if not own:
        yield everyone
        return
    table = np.concatenate([np.broadcast_to(o, (batch, o.shape[-1])) for o in own], axis=1)
    _, which = np.unique(table, axis=0, return_inverse=True)
    which = which.ravel()
    counts = np.bincount(which)
    together = counts[which] < 8
    if together.any():
        yield everyone[together]
    for value in np.flatnonzero(counts >= 8):
        yield everyone[which == value]


def _shared_orders(system: LinearFractionalSystem) -> LinearFractionalSystem:
    """Drop the batch axis of orders that are equal in all members."""

    def shared(term: FractionalTerm) -> FractionalTerm:
        if term.orders.ndim == 2 and np.all(term.orders == term.orders[:1]):
            return FractionalTerm(term.matrix, term.orders[0])
        return term

    return replace(
        system, dynamics=tuple(map(shared, system.dynamics)), control=tuple(map(shared, system.control))
    )


def _hull_classes(rows: Array, radius: Floats, shift: Floats, width: float, ratio: float) -> Iterator[_Group]:
    """Split rows by shift and by pole radius, rounded up to powers of `ratio`, into chunks."""
    level = np.ceil(np.log(radius[rows]) / np.log(ratio)).astype(int)
    for a in np.unique(shift[rows]):
        for k in np.unique(level[shift[rows] == a]):
            group = rows[(shift[rows] == a) & (level == k)]
            bound = float(ratio**k)
            for start in range(0, len(group), _CHUNK):
                yield _Group(group[start : start + _CHUNK], width * bound, bound, float(a))


def _packed(
    response: Response,
    chosen: Array,
    rows: Array,
    stable: Array,
    good: Booleans,
    nodes: Array,
    grid: PanelGrid,
    y0: Floats,
    rate: Floats,
) -> Survey:
    """Flatten (k, b) to k·b trajectories and name their status."""
    k = len(y0)
    everyone = len(chosen) == response.positions.shape[1]

    def flat(values: Floats) -> Floats:
        picked = values if everyone else values[:, chosen]
        return picked.reshape(k * len(chosen), *values.shape[2:])

    status = np.where(good, "ok", "failed").astype(object)
    status[good & (stable == False)] = "unstable"  # noqa: E712 - entries are True, False or None
    m = response.positions.shape[2]
    start = np.concatenate([y0[..., :m], rate[..., :m], y0[..., m:]], axis=-1)
    start = np.broadcast_to(start, (k, response.positions.shape[1], start.shape[-1]))
    rates = response.rates if response.rates is not None else grid.derivative(response.positions)
    trajectory = Trajectory(
        grid=grid,
        initial_state=flat(start),
        positions=flat(response.positions),
        controls_at_nodes=flat(response.controls),
        initial_controls=flat(response.initial_controls),
        rates=flat(rates),
        auxiliary=flat(response.auxiliary),
        status=np.tile(status, k),
        stable=np.tile(stable, k),
        error_estimate=flat(response.error),
        counters={"nodes": np.tile(nodes, k)},
    )
    return Survey(rows, trajectory)


def _without_trajectory(
    rows: Array,
    stable: Array,
    y0: Floats,
    rate: Floats,
    system: LinearFractionalSystem,
    horizon: float,
    diverged: bool,
) -> Survey:
    """Return members proved unstable, with NaN for their trajectories."""
    k, b, m = len(y0), len(rows), system.n_positions
    grid = make_plan(horizon, 1.0, 1.0, 0.0, 1e-6).grid
    start = np.concatenate([y0[..., :m], rate[..., :m], y0[..., m:]], axis=-1)
    start = start[:, rows] if start.shape[1] > 1 else np.broadcast_to(start, (k, b, start.shape[-1]))
    blank = np.full((k * b, m, len(grid.times)), np.nan)
    trajectory = Trajectory(
        grid=grid,
        initial_state=start.reshape(k * b, -1),
        positions=blank,
        controls_at_nodes=blank,
        initial_controls=blank[..., 0],
        rates=blank,
        auxiliary=np.full((k * b, system.n_auxiliary, len(grid.times)), np.nan),
        status=np.full(k * b, "diverged" if diverged else "unstable", dtype=object),
        stable=np.tile(stable, k),
        error_estimate=np.full(k * b, np.nan),
        counters={"nodes": np.zeros(k * b, dtype=np.int64)},
    )
    return Survey(rows, trajectory)


def _merged(parts: list[Survey], batch: int) -> Trajectory:
    """Bring all members to the grid with most nodes."""
    if len(parts) == 1 and np.array_equal(parts[0].rows, np.arange(batch)):
        return parts[0].trajectory
    grid = max((part.trajectory.grid for part in parts), key=lambda g: len(g.times))
    first = parts[0].trajectory

    def gather(name: str, on_grid: bool) -> Array:
        example = getattr(first, name)
        out = np.empty((batch, *example.shape[1:-1], len(grid.times)) if on_grid else (batch, *example.shape[1:]), example.dtype)
        for part in parts:
            values = getattr(part.trajectory, name)
            same = part.trajectory.grid is grid or not on_grid
            out[part.rows] = values if same else part.trajectory.grid.evaluate(values, grid.times)
        return out

    nodes = np.empty(batch, dtype=np.int64)
    for part in parts:
        nodes[part.rows] = part.trajectory.counters["nodes"]
    return Trajectory(
        grid=grid,
        initial_state=gather("initial_state", False),
        positions=gather("positions", True),
        controls_at_nodes=gather("controls_at_nodes", True),
        initial_controls=gather("initial_controls", False),
        rates=gather("rates", True),
        auxiliary=gather("auxiliary", True),
        status=gather("status", False),
        stable=gather("stable", False),
        error_estimate=gather("error_estimate", False),
        counters={"nodes": nodes},
    )
