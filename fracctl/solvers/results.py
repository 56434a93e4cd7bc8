"""From responses of groups to trajectories: status, flattening, and one grid for all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.panels import Panel, PanelGrid
from fracctl.solvers.base import SolvedMembers
from fracctl.solvers.members import Members
from fracctl.solvers.outputs import Values
from fracctl.trajectory import Trajectory


def packed(
    members: Members, response: Values, chosen: Array, good: Booleans, nodes: Array, grid: PanelGrid
) -> SolvedMembers:
    """Return the `chosen` of the members with their status, k·r trajectories."""
    k, count = response.positions.shape[:2]
    everyone = len(chosen) == count

    def flat(values: Floats) -> Floats:
        picked = values if everyone else values[:, chosen]
        return picked.reshape(k * len(chosen), *values.shape[2:])

    stable = members.stable[chosen]
    status = np.where(good[chosen], "ok", "failed").astype(object)
    status[good[chosen] & np.array([verdict is False for verdict in stable], dtype=bool)] = "unstable"
    trajectory = Trajectory(
        grid=grid,
        initial_state=flat(members.initial_states()),
        positions=flat(response.positions),
        controls_at_nodes=flat(response.controls),
        initial_controls=flat(response.initial_controls),
        rates=None if response.rates is None else flat(response.rates),
        auxiliary=flat(response.auxiliary),
        end=np.full(k * len(chosen), grid.horizon),
        events={},
        status=np.tile(status, k),
        stable=np.tile(stable, k),
        error_estimate=flat(response.error),
        counters={"nodes": np.tile(nodes[chosen], k)},
    )
    return SolvedMembers(members.rows[chosen], trajectory)


def without_trajectory(members: Members, status: str) -> SolvedMembers:
    """Return members that have no trajectory, with NaN in its place and `status` to say why."""
    start = members.initial_states()
    k, b, _ = start.shape
    m, q = members.system.n_positions, members.system.n_auxiliary
    grid = PanelGrid([Panel(0.0, members.horizon, 4)])
    blank = np.full((k * b, m, len(grid.times)), np.nan)
    trajectory = Trajectory(
        grid=grid,
        initial_state=start.reshape(k * b, -1),
        positions=blank,
        controls_at_nodes=blank,
        initial_controls=blank[..., 0],
        rates=blank,
        auxiliary=np.full((k * b, q, len(grid.times)), np.nan),
        end=np.zeros(k * b),
        events={},
        status=np.full(k * b, status, dtype=object),
        stable=np.tile(members.stable, k),
        error_estimate=np.full(k * b, np.nan),
        counters={"nodes": np.zeros(k * b, dtype=np.int64)},
    )
    return SolvedMembers(members.rows, trajectory)


def merged(parts: list[SolvedMembers], batch: int, common: PanelGrid | None = None) -> Trajectory:
    """Bring all members to one grid, by default one that resolves them all."""
    first = parts[0].trajectory
    if len(parts) == 1 and np.array_equal(parts[0].rows, np.arange(batch)):
        return first
    grid = common or _resolving([part.trajectory.grid for part in parts])
    times = grid.times.copy()
    last = grid.offsets[1:] - 1
    times[last] = np.nextafter(times[last], 0.0)
    order = np.concatenate([part.rows for part in parts])
    place = np.argsort(order, kind="stable")

    def joined(name: str) -> Array:
        return np.concatenate([getattr(part.trajectory, name) for part in parts])[place]

    def regridded(name: str) -> Floats:
        values = [
            getattr(t, name) if t.grid is grid else t.grid.evaluate(getattr(t, name), times)
            for t in (part.trajectory for part in parts)
        ]
        out: Floats = np.concatenate(values)[place]
        return out

    return replace(
        first,
        grid=grid,
        positions=regridded("positions"),
        controls_at_nodes=regridded("controls_at_nodes"),
        rates=regridded("rates"),
        auxiliary=regridded("auxiliary"),
        initial_state=joined("initial_state"),
        initial_controls=joined("initial_controls"),
        end=joined("end"),
        events={name: np.concatenate([part.trajectory.events[name] for part in parts])[place] for name in first.events},
        status=joined("status"),
        stable=joined("stable"),
        error_estimate=joined("error_estimate"),
        counters={"nodes": np.concatenate([part.trajectory.counters["nodes"] for part in parts])[place]},
    )


def _resolving(grids: list[PanelGrid]) -> PanelGrid:
    """Return the grid with most nodes, its first panel replaced by those of the grid whose own ends first.

    The most nodes are those of the fastest oscillation; what decays without one is resolved by short panels near 0.
    """
    most, early = max(grids, key=lambda g: len(g.times)), min(grids, key=lambda g: g.panels[0].end)
    edge = most.panels[0].end
    if early.panels[0].end >= edge:
        return most
    before = [replace(panel, end=min(panel.end, edge)) for panel in early.panels if panel.start < edge]
    return PanelGrid([*before, *most.panels[1:]])
