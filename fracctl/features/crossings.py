"""Times at which functions on panels cross a level, and their values at given times, compiled."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.panels import PanelGrid
from fracctl.polynomials import SWELL, as_rows, at, compiled, extremes, over_rows, peak, root, time_at, weighted

_ERROR = 1e-13
"""Bound of the error of a crossing, in distances of nodes."""


def last_crossing(grid: PanelGrid, values: Floats, level: float) -> Floats:
    """Return the last time at which |values| = level, (…): 0 if never above, +inf if above or NaN at the end.

    Args:
        grid: panels with T nodes in all.
        values: (…, T).
        level: positive.
    """
    times = _last_crossings(grid.nodes, grid.offsets, grid.slopes, grid.clock, as_rows(values), float(level))
    return times.reshape(values.shape[:-1])


def value_at(grid: PanelGrid, values: Floats, times: Floats) -> Floats:
    """Return values (b, T) at one time for each member, times (b,), as (b,)."""
    panels, y = grid.locate(times)
    found: Floats = _values_at(grid.nodes, grid.offsets, as_rows(values), panels, y)
    return found


@over_rows
def _values_at(nodes: Floats, offsets: Array, rows: Floats, panels: Array, points: Floats) -> Floats:
    """Value of each row at its own point."""
    out = np.empty(len(points))
    for i in range(len(points)):
        first, stop = offsets[panels[i]], offsets[panels[i] + 1]
        out[i] = at(nodes, rows[i], first, stop, points[i])
    return out


@over_rows
def _last_crossings(nodes: Floats, offsets: Array, slopes: Floats, clock: Floats, rows: Floats, level: float) -> Floats:
    """Time of the last crossing of each row."""
    times = np.empty(len(rows))
    for i in range(len(rows)):
        row = rows[i]
        times[i] = 0.0 if abs(row[-1]) <= level else np.inf
        panel = len(offsets) - 1
        while times[i] == 0.0 and panel > 0:
            panel -= 1
            first, stop = offsets[panel], offsets[panel + 1]
            low, high = extremes(row, first, stop)
            if SWELL * max(high, -low) > level:
                y = _last_in_panel(nodes, slopes, row, first, stop, level)
                times[i] = time_at(clock, panel, y) if y >= -1.0 else 0.0
    return times


@compiled
def _last_in_panel(nodes: Floats, slopes: Floats, row: Floats, first: int, stop: int, level: float) -> float:
    """y of the last crossing in one panel that ends below the level or just above it; -2 if there is none."""
    if abs(row[stop - 1]) > level:
        return 1.0
    for j in range(stop - 2, first - 1, -1):
        here, there = row[j], row[j + 1]
        low, f_low = nodes[0, j], here
        if abs(here) <= level:
            i, k = (j, j + 1) if abs(here) >= abs(there) else (j + 1, j)
            if SWELL * abs(row[i]) > level:
                slope = weighted(slopes, i, row, first, stop)
                if abs(row[i] + slope * (nodes[0, k] - nodes[0, i])) > level:
                    low, f_low = peak(nodes, row, first, stop, i, k, slope)
        if abs(f_low) > level:
            limit = level if f_low > 0.0 else -level
            return root(nodes, row, first, stop, low, nodes[0, j + 1], f_low - limit, there - limit, limit, _ERROR)
    return -2.0
