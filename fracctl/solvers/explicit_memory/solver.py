"""Nonlinear and saturated loops under laws with fractional memory: collocation on steps, the past in exponentials.

On a step the highest derivatives ξ'' and z' are a polynomial through Chebyshev nodes. The fractional integrals that
the law is made of are exact for it; what the steps before add to them is kept by some hundred filters, whatever the
number of steps (`fracctl.fractional.sum_of_exponentials`). So the work grows with the time, not with its square.
Steps double from a very short one, for solutions are powers of time at 0, and they end where saturation sets in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Booleans, Floats, finite, positive, share
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.winding import unstable_zeros, verdicts
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop, Need
from fracctl.panels import Panel, PanelGrid
from fracctl.plants.capabilities import members_of
from fracctl.plants.linear import LinearPlant
from fracctl.plants.state import StatePlant
from fracctl.solvers.base import SolvedMembers
from fracctl.solvers.explicit_memory.law import highest_used, signals
from fracctl.solvers.explicit_memory.mesh import step_edges
from fracctl.solvers.explicit_memory.run import Problem, Run, run
from fracctl.solvers.members import Members, common_batch, equal_orders, whole
from fracctl.solvers.results import merged
from fracctl.trajectory import Trajectory

NODES = 14
"""Nodes on a step."""
_COARSE_NODES = 10
_FIRST_STEP = 1e-9
"""Over an even step, or a tenth of the tolerance; between its nodes controls are powers of time, no polynomials."""
_COARSER = 8.0
"""First step and kernel error of the coarse solution over those of the fine one."""
_OF_THE_KERNEL = 1e-2
"""Its share of the tolerance."""
_MOST_DOUBLINGS = 6
_DIVERGED = 1e3
"""Growth of the states beyond which a motion that could not be followed is called diverged, not failed."""
_TOGETHER = 256
"""Members that are solved together; saturated ones share the breaks of all."""
_TOGETHER_SATURATED = 32


class ExplicitMemory:
    """Collocation of ξ'' = g(t, ξ, ξ') + υ under a linear law of any orders, with or without a limit of υ.

    Only calls of g are needed: Picard's iteration finds the polynomials, for whole batches. The solution is computed
    on few nodes, then on many; what misses the tolerance again on steps half as long, with the kinks that were
    found for ends of steps. `error_estimate` is the difference of the last two, thus the error of the coarser, and 1 %
    of the tolerance for what both have in common.

    Args:
        steps: even steps in 2π of time to begin with, from 1 to 1000.
        tolerance: largest error relative to the peaks of positions and controls, in [1e-11, 1e-3].
        cross_check: share of a survey's rows that the contour solver computes too, in [0, 1]; linear loops only.

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    name = "explicit_memory"
    checked_by = "contour"

    def __init__(self, steps: int = 8, tolerance: float = 1e-8, cross_check: float = 0.0) -> None:
        self.steps = whole("steps", steps, 1, 1000)
        if not 1e-11 <= tolerance <= 1e-3:
            raise ArgumentError("tolerance", tolerance, "must lie in [1e-11, 1e-3]")
        self.tolerance, self.cross_check = float(tolerance), share("cross_check", cross_check)

    def supports(self, loop: ClosedLoop) -> str | None:
        """Return None for second-order plants under linear laws, otherwise why a loop is refused and the cure."""
        for need, use in ((Need.DELAYS, "method_of_steps"), (Need.NONLINEAR_LAW, "implicit_memory")):
            if need in loop.needs:
                return f"the {self.name} solver takes linear laws, but this loop has {need}; use '{use}'"
        if not _is_second_order(loop.plant):
            return (
                f"the {self.name} solver takes plants whose states are m positions and then their rates, one control"
                f" each, but {type(loop.plant).__name__} has others; choose such states"
            )
        beyond = loop.needs - {Need.FRACTIONAL_TERMS}
        if self.cross_check and beyond:
            found = " and ".join(sorted(beyond))
            return f"no second solver takes a loop with {found}; set cross_check to 0"
        positions, others = highest_used(loop.law_terms, loop.plant.n_controls)
        if positions >= 2.0 or others >= 1.0:
            return (
                f"the {self.name} solver takes terms of an order below 2 of positions and 1 of auxiliary states, but"
                f" one has {positions if positions >= 2.0 else others:g}; solve the equation for its highest"
                " derivatives"
            )
        return None

    def solve(self, loop: ClosedLoop, initial_state: ArrayLike, horizon: float) -> Trajectory:
        """Return the trajectories of all members on one grid.

        Args:
            loop: the closed loop, of b members or a single one.
            initial_state: [ξ(0), ξ'(0)], (n,), or (b, n) one a member.
            horizon: S > 0, the last time.

        Raises:
            ArgumentError: a shape does not fit, or the horizon is not positive.
            UnsupportedError: the solver does not take the loop.
        """
        self._check(loop)
        state = finite("initial_state", initial_state)
        start = np.concatenate(_states(loop, state), axis=-1)
        batch = common_batch(loop.batch, len(state) if state.ndim == 2 else None)
        start = np.broadcast_to(start, (1, batch, start.shape[-1]))
        parts = list(self._parts(loop, start, positive("horizon", horizon)))
        trajectory = merged(parts, batch, _common_grid(parts))
        return replace(trajectory, batched=loop.batch is not None or state.ndim == 2)

    def survey(self, loop: ClosedLoop, initial_states: ArrayLike, horizon: float) -> Iterator[SolvedMembers]:
        """Yield members group by group, each from all k initial states (k, n)."""
        self._check(loop)
        start = np.concatenate(_states(loop, np.atleast_2d(finite("initial_states", initial_states))), axis=-1)
        start = np.repeat(start[:, None], loop.batch or 1, axis=1)
        yield from self._parts(loop, start, positive("horizon", horizon))

    def _check(self, loop: ClosedLoop) -> None:
        refusal = self.supports(loop)
        if refusal:
            raise UnsupportedError(refusal)

    def _parts(self, loop: ClosedLoop, start: Floats, horizon: float) -> Iterator[SolvedMembers]:
        """Solve from states (k, b, n), some members at a time."""
        k, b, n = start.shape
        stable = _verdicts(loop, b, horizon)
        law = signals(loop.law_terms, loop.plant.n_controls)
        together = _TOGETHER if loop.saturation is None else _TOGETHER_SATURATED
        chunk = max(together // k, 1)
        for first in range(0, b, chunk):
            rows = np.arange(first, min(first + chunk, b))
            everyone = np.tile(rows, k)
            limit = None if loop.saturation is None else loop.saturation.take(everyone)
            states = start[:, rows].reshape(k * len(rows), n)
            problem = Problem(members_of(loop.plant, everyone), law.take(everyone), limit, states, horizon)
            for part in self._solved(problem, k):
                yield _packed(part, rows, stable, k, self.tolerance)

    def _solved(self, problem: Problem, k: int) -> Iterator[_Part]:
        """Refine until the difference of two solutions is small; yield members that are done from all k states."""
        turns, kernel = problem.horizon / (2.0 * np.pi), _OF_THE_KERNEL * self.tolerance
        count = max(int(np.ceil(self.steps * turns)), 1)
        first = min(_FIRST_STEP, 0.1 * self.tolerance) * problem.horizon / count

        def on(steps: int, breaks: Floats) -> Floats:
            return step_edges(problem.horizon, steps, first, breaks, problem.has_powers)

        rows = np.arange(len(problem.start) // k)
        with np.errstate(all="ignore"):
            edges = step_edges(problem.horizon, count, _COARSER * first, np.zeros(0), problem.has_powers)
            before = run(problem, edges, _COARSE_NODES, min(_COARSER * kernel, 0.1))
            nodes = np.full(len(problem.start), edges.size * _COARSE_NODES)
            for attempt in range(_MOST_DOUBLINGS + 1):
                breaks = before.breaks
                count *= 1 if attempt == 0 or (attempt == 1 and breaks.size) else 2
                edges = on(count, breaks)
                after = run(before.problem, edges, NODES, max(kernel, 1e-13))
                error, nodes = after.difference(before) + kernel, nodes + edges.size * NODES
                good = (error <= self.tolerance).reshape(k, -1).all(axis=0) | (attempt == _MOST_DOUBLINGS)
                if good.any():
                    which = np.flatnonzero(np.tile(good, k))
                    yield _Part(after.take(which), rows[good], error[which], nodes[which])
                left = np.flatnonzero(np.tile(~good, k))
                if not left.size:
                    return
                before, rows, nodes = after.take(left), rows[~good], nodes[left]


@dataclass(frozen=True)
class _Part:
    run: Run
    rows: Array
    """Which of the chunk."""
    error: Floats
    nodes: Array


def _packed(part: _Part, rows: Array, stable: Array, k: int, tolerance: float) -> SolvedMembers:
    """Return members as trajectories with their status; NaN behind events and where nothing was found."""
    solved, m = part.run, part.run.problem.signals.n_positions
    b = len(part.error)
    verdict = np.tile(stable[rows[part.rows]], k)
    status = np.where(part.error <= tolerance, "ok", "failed").astype(object)
    status[(status == "ok") & np.equal(verdict, False)] = "unstable"
    ended = solved.ended[1] != None  # noqa: E711 - an array of words
    status[ended & (status != "failed")] = solved.ended[1][ended & (status != "failed")]
    status[~solved.complete] = np.where(_has_grown(solved), "diverged", "failed")[~solved.complete]
    shown = solved.alive & solved.complete[:, None]
    end = np.where(solved.complete, np.minimum(solved.ended[0], solved.problem.horizon), 0.0)

    def at_nodes(values: Floats) -> Floats:
        return np.where(shown[:, None, :, None], values, np.nan).reshape(b, values.shape[1], len(solved.grid.times))

    trajectory = Trajectory(
        grid=solved.grid,
        initial_state=solved.problem.start,
        positions=at_nodes(solved.values[:, :m]),
        controls_at_nodes=at_nodes(solved.controls),
        initial_controls=np.ascontiguousarray(solved.controls[:, :, 0, 0]),
        rates=at_nodes(solved.values[:, m : 2 * m]),
        auxiliary=at_nodes(solved.values[:, 2 * m :]),
        end=end,
        events={name: np.where(times <= end, times, np.nan) for name, times in solved.events.items()},
        status=status,
        stable=verdict,
        error_estimate=np.where(np.isfinite(part.error), part.error, np.nan),
        counters={"nodes": part.nodes},
    )
    return SolvedMembers(rows[part.rows], trajectory)


def _has_grown(solved: Run) -> Booleans:
    """Return whether members have left the neighbourhood of where they began by orders of magnitude, (b,)."""
    n = 2 * solved.problem.signals.n_positions
    reached = np.nanmax(np.abs(solved.values[:, :n]), axis=(1, 2, 3), initial=0.0)
    grown: Booleans = reached > _DIVERGED * np.abs(solved.problem.start[:, :n]).max(axis=1)
    return grown


def _states(loop: ClosedLoop, states: Floats) -> tuple[Floats, Floats, Floats]:
    """Return ξ(0), ξ'(0) and z(0) with one leading axis."""
    m = loop.plant.n_controls
    value, rate = (np.atleast_2d(part) for part in loop.initial_values(states))
    return value[:, :m], rate[:, :m], value[:, m:]


def _verdicts(loop: ClosedLoop, batch: int, horizon: float) -> Array:
    """Return True, False, or None where nobody knows, (b,) objects: whether poles lie in the right half plane."""
    known = np.full(batch, None, dtype=object)
    if not isinstance(loop.plant, LinearPlant) or loop.saturation is not None:
        return known
    nothing = np.zeros((1, 1, loop.system.size))
    everyone = Members(replace(loop.system, batch=batch), nothing, nothing, horizon, every=False)
    for which in equal_orders(everyone.system, 1):
        matrix = CharacteristicMatrix(everyone.take(which).system)
        known[which] = verdicts(*unstable_zeros(matrix))
    return known


def _is_second_order(plant: LinearPlant | StatePlant) -> bool:
    """Whether the states are positions and their rates."""
    m, n = plant.n_controls, plant.n_states
    if n != 2 * m:
        return False
    probe = np.linspace(0.1, 0.9, n)[None]
    one = members_of(plant, np.zeros(1, dtype=np.intp))
    rates: Booleans = one.rates(np.zeros(1), probe, np.zeros((1, m)))[:, :m] == probe[:, m:]
    return bool(rates.all())


def _common_grid(parts: list[SolvedMembers]) -> PanelGrid | None:
    """Return a grid on which the polynomials of all parts are polynomials; None for a single part."""
    if len(parts) == 1:
        return None
    ends = np.unique(np.concatenate([[p.end for p in part.trajectory.grid.panels] for part in parts]))
    starts = np.concatenate([[0.0], ends[:-1]])
    return PanelGrid([Panel(float(a), float(b), NODES) for a, b in zip(starts, ends, strict=True)])
