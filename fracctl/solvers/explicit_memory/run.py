"""One pass over all steps: collocation of the highest derivatives, found by Picard's iteration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.controllers.saturation import Saturation
from fracctl.fractional.collocation import chebyshev_nodes, integral_matrix
from fracctl.panels import Panel, PanelGrid
from fracctl.plants.capabilities import control_events, members_of
from fracctl.plants.state import Event, StatePlant
from fracctl.solvers.explicit_memory.history import History
from fracctl.solvers.explicit_memory.law import Signals
from fracctl.solvers.explicit_memory.mesh import crossings

_MOST_ITERATIONS = 60
_CONVERGED = 1e-3
"""Last change of an iteration over the tolerance."""
_LEAST_CHANGE = 2e-14


@dataclass(frozen=True)
class Problem:
    """What is solved: b members and what they start from."""

    plant: StatePlant
    signals: Signals
    saturation: Saturation | None
    start: Floats
    """[ξ(0), ξ'(0), z(0)], (b, 2m + q)."""
    horizon: float

    def take(self, rows: Array) -> Problem:
        """Return some of the members."""
        limit = None if self.saturation is None else self.saturation.take(rows)
        plant = members_of(self.plant, rows)
        return replace(self, plant=plant, signals=self.signals.take(rows), saturation=limit, start=self.start[rows])

    @property
    def has_powers(self) -> bool:
        """Whether the solution has powers of time that are no integers."""
        return bool(np.any((self.signals.orders > 0.0) & (self.signals.orders < 1.0)))

    def accelerations(self, t: Floats, x: Floats, demand: Floats) -> tuple[Floats, Floats]:
        """Return ξ'' and υ, (m, b, K), of times (K,), states (2m, b, K) and demands (m, b, K)."""
        m, b, k = demand.shape
        control = demand.transpose(1, 2, 0)
        if self.saturation is not None:
            control = self.saturation(control)
        flat = np.ascontiguousarray(control).reshape(b * k, m)
        states = np.ascontiguousarray(x.transpose(1, 2, 0)).reshape(b * k, 2 * m)
        plant = self.plant if k == 1 else members_of(self.plant, np.repeat(np.arange(b), k))
        rates = plant.rates(np.tile(t, b), states, flat)
        return rates[:, m:].reshape(b, k, m).transpose(2, 0, 1), control.transpose(2, 0, 1)


@dataclass(frozen=True)
class Run:
    """The motion of b members on P steps of K nodes, and how it ended."""

    problem: Problem
    edges: Floats
    """Of the steps, (P + 1,)."""
    values: Floats
    """[ξ, ξ', z] at the nodes, (b, 2m + q, P, K); NaN where there is none."""
    demands: Floats
    """w at the nodes, (b, m, P, K)."""
    controls: Floats
    """υ at the nodes, (b, m, P, K)."""

    @cached_property
    def grid(self) -> PanelGrid:
        """The steps as panels."""
        k = self.values.shape[-1]
        return PanelGrid([Panel(float(a), float(b), k) for a, b in zip(self.edges[:-1], self.edges[1:], strict=True)])

    def take(self, rows: Array) -> Run:
        """Return some of the members."""
        everyone = (self.values, self.demands, self.controls)
        return Run(self.problem.take(rows), self.edges, *(array[rows] for array in everyone))

    @property
    def breaks(self) -> Floats:
        """Times at which steps should end: where saturation sets in or ends, and where members end."""
        limit, end = self.problem.saturation, self.ended[0]
        ends = end[np.isfinite(end)]
        if limit is None:
            return ends

        def excess(members: Array, times: Floats, demands: Floats) -> Floats:
            del times
            return limit.take(members).excess(demands)

        signs = np.moveaxis(limit.excess(np.moveaxis(self.demands, 1, -1)), -1, 1)
        members, times = crossings(self.demands, self.edges, excess, signs)
        return np.concatenate([ends, times[times < end[members]]])

    @cached_property
    def events(self) -> dict[str, Floats]:
        """First time of each event, infinite where it does not happen, each (b,); not cut off where members end."""
        plant, states = self.problem.plant, self.values[:, : 2 * self.problem.signals.n_positions]
        of_states = {event.name: self._first(event, states) for event in plant.events}
        return of_states | {event.name: self._first(event, self.controls) for event in control_events(plant)}

    def _first(self, event: Event, values: Floats) -> Floats:
        """Return when an event of states or controls at the nodes (b, n, P, K) happens first, (b,)."""
        b, n = values.shape[:2]
        first = np.where(event.function(np.zeros(b), values[:, :, 0, 0]) < 0.0, 0.0, np.inf)
        flat = np.moveaxis(values, 1, -1).reshape(-1, n)
        signs = event.function(np.tile(self.grid.times, b), flat).reshape(b, 1, *values.shape[2:])
        members, found = crossings(values, self.edges, partial(_of_nodes, event), signs)
        np.minimum.at(first, members, found)
        return first

    @cached_property
    def ended(self) -> tuple[Floats, Array]:
        """When members end, (b,), infinite for those that do not, and by which event, (b,) words or None."""
        end, names = np.full(len(self.values), np.inf), np.full(len(self.values), None, dtype=object)
        for event in (*self.problem.plant.events, *control_events(self.problem.plant)):
            earlier = self.events[event.name] < end
            if event.terminal:
                end[earlier], names[earlier] = self.events[event.name][earlier], event.name
        return end, names

    @cached_property
    def alive(self) -> Booleans:
        """Nodes at which members have not ended, (b, P): steps more than half of which lies before an event."""
        middle = 0.5 * (self.edges[1:] + self.edges[:-1])
        whole: Booleans = np.isfinite(self.values).all(axis=(1, 3)) & (middle < self.ended[0][:, None])
        return whole

    def difference(self, other: Run) -> Floats:
        """Return the largest difference of positions and controls over their peaks, (b,).

        Infinite where one of the two ends otherwise. Controls on the first steps, powers of time between the nodes, are
        left out.
        """
        m = self.problem.signals.n_positions
        b, times = len(self.values), self.grid.times
        mine = np.repeat(self.alive, self.values.shape[-1], axis=1)
        panels, _ = other.grid.locate(times)
        both = mine & other.alive[:, panels]
        error = np.zeros(b)
        for ours, others, counted in (
            (self.values[:, :m], other.values[:, :m], both),
            (self.controls, other.controls, both & (times > other.edges[1])),
        ):
            flat = ours.reshape(b, m, -1)
            gap = np.abs(flat - other.grid.evaluate(others.reshape(b, m, -1), times)).max(axis=1)
            peak = np.where(mine, np.abs(flat).max(axis=1), 0.0).max(axis=1)
            gap = np.where(counted, gap, 0.0).max(axis=1)
            error = np.maximum(error, np.divide(gap, peak, out=np.zeros(b), where=gap > 0.0))
        unlike = (self.ended[1] != other.ended[1]) | ~self.complete | ~other.complete
        return np.where(unlike, np.inf, error)

    @property
    def complete(self) -> Booleans:
        """Whether members came to the horizon or to an event, (b,)."""
        middle = 0.5 * (self.edges[1:] + self.edges[:-1])
        found: Booleans = np.all(self.alive | (middle >= self.ended[0][:, None]), axis=1)
        return found


def _of_nodes(event: Event, members: Array, times: Floats, values: Floats) -> Floats:
    del members
    return event.function(times, values)[:, None]


def run(problem: Problem, edges: Floats, nodes: int, tolerance: float) -> Run:
    """Solve on steps with K nodes each, with a kernel that is right to a tolerance."""
    signals, start = problem.signals, problem.start.T
    m, q = signals.n_positions, signals.n_auxiliary
    b, count = start.shape[1], len(edges) - 1
    steps = np.diff(edges)
    steps = np.where(np.abs(steps - steps.max()) < 1e-12 * steps.max(), steps.max(), steps)
    history = History(signals, b, nodes, float(steps.min()), float(edges[-1]), tolerance)
    c, integral = chebyshev_nodes(nodes).t, integral_matrix(nodes, 1.0).T
    plain = np.setdiff1d(np.arange(len(signals.sources)), history.deep)
    integrals = np.empty((len(signals.sources), b, nodes))

    def motion(highest: Floats, step: float, first: Floats) -> Floats:
        """Return [ξ, ξ', ξ'', z, z'] at the nodes from [ξ'', z'] there and [ξ, ξ', z] at the first."""
        once = step * (highest @ integral)
        rates = first[m : 2 * m, :, None] + once[:m]
        places = first[:m, :, None] + step * (rates @ integral)
        return np.concatenate([places, rates, highest[:m], first[2 * m :, :, None] + once[m:], highest[m:]])

    def law(values: Floats, deep: Floats) -> Floats:
        """Return [w, z'], (m + q, b, K)."""
        integrals[plain], integrals[history.deep] = values[signals.sources[plain]], deep
        return np.moveaxis(signals.gains @ integrals.transpose(1, 0, 2), 0, 1)

    first = start.copy()
    values = motion(np.zeros((m + q, b, nodes)), 0.0, first)
    demand = law(values, history.on_step(0.0, values))[..., :1]
    pull, control = problem.accelerations(edges[:1], first[: 2 * m, :, None], demand[:m])
    begin = np.concatenate([pull, demand[m:]]), demand[:m], control
    kept = np.full((2 * m + q, b, count, nodes), np.nan)
    demands, controls = np.full((m, b, count, nodes), np.nan), np.full((m, b, count, nodes), np.nan)
    peak = np.zeros((m + q, b))
    small = max(_CONVERGED * tolerance, _LEAST_CHANGE)
    alive = np.ones(b, dtype=bool)
    for i, step in enumerate(steps.tolist()):
        times, earlier = edges[i] + step * c, history.before(step)
        highest = np.repeat(begin[0], nodes, axis=2)
        settled = np.zeros(b, dtype=bool)
        for _ in range(_MOST_ITERATIONS):
            values = motion(highest, step, first)
            wanted = law(values, earlier + history.on_step(step, values))
            wanted[:, :, 0] = np.concatenate([begin[1], begin[0][m:]])[..., 0]
            pull, control = problem.accelerations(times, values[: 2 * m], wanted[:m])
            new = np.concatenate([pull, wanted[m:]])
            new[:, :, 0] = begin[0][..., 0]
            change, size = np.abs(new - highest).max(axis=2), np.abs(new).max(axis=2)
            highest = new
            grown = np.maximum(peak, _by_kind(size, m))
            settled[:] = ~alive | (change <= small * grown).all(axis=0)
            if settled.all() or not np.isfinite(change[:, alive & ~settled]).any():
                break
        alive &= settled
        peak = np.where(alive, _by_kind(np.maximum(peak, size), m), peak)
        if not alive.any():
            break
        values = motion(np.where(alive[:, None], highest, np.nan), step, first)
        kept[:, :, i] = np.concatenate([values[: 2 * m], values[3 * m : 3 * m + q]])
        demands[:, :, i] = np.where(alive[:, None], wanted[:m], np.nan)
        controls[:, :, i] = np.where(alive[:, None], control, np.nan)
        history.keep(step, values)
        first = kept[:, :, i, -1]
        begin = highest[..., -1:], demands[:, :, i, -1:], controls[:, :, i, -1:]
    return Run(problem, edges, *(np.moveaxis(a, 1, 0) for a in (kept, demands, controls)))


def _by_kind(sizes: Floats, m: int) -> Floats:
    """Return the largest of the positions' sizes and of the others', for each of them."""
    out = np.empty_like(sizes)
    out[:m], out[m:] = sizes[:m].max(axis=0), sizes[m:].max(axis=0, initial=0.0)
    return out
