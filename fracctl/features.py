"""Crossings, extrema and absolute integrals of functions on panels, exact on the interpolant, for whole batches.

The nodes tell in which interval a feature lies; safeguarded iterations on the panel's polynomial find it. The
kernels are compiled by numba and kept in its cache on disk: these loops branch on every member, and as array
expressions they cost ten times as much.
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.panels import PanelGrid
from fracctl.polynomials import at, bracketed_root, compiled, node_root, peak

_NOISE = 1e-11
"""Rise, relative to the largest magnitude, below which a maximum is rounding."""


def last_crossing(grid: PanelGrid, values: Floats, slopes: Floats, level: float) -> Floats:
    """Return the last time at which |values| = level, (b,): 0 if never above, +inf if above at the end.

    Args:
        grid: panels with T nodes in all.
        values: (b, T).
        slopes: `grid.slope(values)`.
        level: positive.
    """
    rows, slopes = np.ascontiguousarray(values), np.ascontiguousarray(slopes)
    panels, y = _last_crossings(grid.y, grid.weights, grid.offsets, rows, slopes, float(level))
    times = np.full(len(values), np.inf)
    times[panels == _NEVER] = 0.0
    found = np.flatnonzero(panels >= 0)
    times[found] = grid.time_at(panels[found], y[found])
    return times


def largest_excursion(grid: PanelGrid, values: Floats, slopes: Floats, side: Floats, with_end: bool) -> Floats:
    """Return the largest local maximum, at least 0, of side · values, or of ± values where side is 0, as (b,).

    The end of the horizon counts as a maximum on request; the beginning never does.

    Args:
        grid: panels with T nodes in all.
        values: (b, T).
        slopes: `grid.slope(values)`.
        side: -1, 0 or 1 for each member, (b,).
        with_end: whether the value at the end counts.
    """
    rows, slopes = np.ascontiguousarray(values), np.ascontiguousarray(slopes)
    largest: Floats = _largest_excursions(grid.y, grid.weights, grid.offsets, rows, slopes, side, with_end)
    return largest


def absolute_integral(grid: PanelGrid, values: Floats) -> Floats:
    """Return ∫ |values| dt over the grid for values (b, T), with every change of sign located, as (b,)."""
    contiguous = np.ascontiguousarray(values)
    slopes, integrals = grid.slope(contiguous), grid.integral(contiguous)
    totals: Floats = _absolute_integrals(grid.y, grid.weights, grid.offsets, contiguous, slopes, integrals)
    return totals


def value_at(grid: PanelGrid, values: Floats, times: Floats) -> Floats:
    """Return values (b, T) at one time for each member, times (b,), as (b,)."""
    panels, y = grid.locate(times)
    found: Floats = _values_at(grid.y, grid.weights, grid.offsets, np.ascontiguousarray(values), panels, y)
    return found


_NEVER, _BEYOND = -1, -2


@compiled
def _values_at(y: Floats, weights: Floats, offsets: Array, values: Floats, panels: Array, points: Floats) -> Floats:
    """Value of each member at its own point."""
    out = np.empty(len(points))
    for i in range(len(points)):
        first, stop = offsets[panels[i]], offsets[panels[i] + 1]
        out[i] = at(y, weights, values[i], first, stop, points[i])
    return out


@compiled
def _last_crossings(
    y: Floats, weights: Floats, offsets: Array, values: Floats, slopes: Floats, level: float
) -> tuple[Array, Floats]:
    """Panel (or _NEVER, _BEYOND) and y of the last crossing of each member."""
    count, nodes = values.shape
    panels, points = np.full(count, _NEVER), np.zeros(count)
    for i in range(count):
        row, slope = values[i], slopes[i]
        if not abs(row[nodes - 1]) <= level:
            panels[i] = _BEYOND
            continue
        for panel in range(len(offsets) - 2, -1, -1):
            first, stop = offsets[panel], offsets[panel + 1]
            point = _last_in_panel(y, weights, row, slope, first, stop, level)
            if point >= -1.0:
                panels[i], points[i] = panel, point
                break
    return panels, points


@compiled
def _last_in_panel(
    y: Floats, weights: Floats, row: Floats, slope: Floats, first: int, stop: int, level: float
) -> float:
    """y of the last crossing in one panel that ends below the level or just above it; -2 if there is none."""
    if abs(row[stop - 1]) > level:
        return 1.0
    for j in range(stop - 2, first - 1, -1):
        here, there = row[j], row[j + 1]
        sign = 1.0 if here > 0.0 else -1.0
        if abs(here) > level:
            return node_root(y, weights, row, slope, first, stop, j, sign * level, 1e-8)
        if sign * slope[j] > 0.0 >= sign * slope[j + 1] and abs(here) + abs(slope[j]) * (y[j + 1] - y[j]) > level:
            top, height = peak(y, weights, row, slope, first, stop, j)
            if sign * height > level:
                f_top, f_there = height - sign * level, there - sign * level
                return bracketed_root(y, weights, row, first, stop, top, y[j + 1], f_top, f_there, sign * level)
    return -2.0


@compiled
def _largest_excursions(
    y: Floats, weights: Floats, offsets: Array, values: Floats, slopes: Floats, side: Floats, with_end: bool
) -> Floats:
    """Largest excursion of each member."""
    largest = np.zeros(len(values))
    for i in range(len(values)):
        noise = _NOISE * np.max(np.abs(values[i]))
        for sign in (-1.0, 1.0):
            if side[i] != -sign:
                found = _largest_maximum(y, weights, offsets, values[i], slopes[i], sign, noise)
                end = sign * values[i, -1] if with_end else 0.0
                largest[i] = max(largest[i], found, end)
    return largest


@compiled
def _largest_maximum(
    y: Floats, weights: Floats, offsets: Array, row: Floats, slope: Floats, sign: float, noise: float
) -> float:
    """Largest local maximum of sign · row that stands above what lies between it and the last one by `noise`.

    Where the first panel is flat, slopes are rounding.
    """
    best, lowest = 0.0, sign * row[0]
    for panel in range(len(offsets) - 1):
        first, stop = offsets[panel], offsets[panel + 1]
        for j in range(first, stop - 1):
            here, there = sign * row[j], sign * row[j + 1]
            rise = sign * slope[j]
            lowest = min(lowest, here)
            if rise > 0.0 >= sign * slope[j + 1]:
                reach = here + rise * (y[j + 1] - y[j])
                if reach > best and max(here, there) - lowest > noise:
                    height = peak(y, weights, row, slope, first, stop, j)[1]
                    best = max(best, sign * height)
                lowest = there
    return best


@compiled
def _absolute_integrals(
    y: Floats, weights: Floats, offsets: Array, values: Floats, slopes: Floats, integrals: Floats
) -> Floats:
    """∫ |values| of each member, from the values and their integrals from the start of each panel."""
    totals = np.zeros(len(values))
    for i in range(len(values)):
        row, slope, integral = values[i], slopes[i], integrals[i]
        for panel in range(len(offsets) - 1):
            first, stop = offsets[panel], offsets[panel + 1]
            mark = 0.0
            for j in range(first, stop - 1):
                here, there = row[j], row[j + 1]
                if (here > 0.0) != (there > 0.0):
                    zero = node_root(y, weights, row, slope, first, stop, j, 0.0, 1e-4)
                    reached = at(y, weights, integral, first, stop, zero)
                    totals[i] += abs(reached - mark)
                    mark = reached
                elif _may_dip(here, there, slope[j], slope[j + 1], y[j + 1] - y[j]):
                    low, bottom = peak(y, weights, row, slope, first, stop, j)
                    if (bottom > 0.0) != (here > 0.0):
                        down = bracketed_root(y, weights, row, first, stop, y[j], low, here, bottom, 0.0)
                        up = bracketed_root(y, weights, row, first, stop, low, y[j + 1], bottom, there, 0.0)
                        reached = at(y, weights, integral, first, stop, down)
                        totals[i] += abs(reached - mark)
                        mark = at(y, weights, integral, first, stop, up)
                        totals[i] += abs(mark - reached)
            totals[i] += abs(integral[stop - 1] - mark)
    return totals


@compiled
def _may_dip(here: float, there: float, fall: float, rise: float, width: float) -> bool:
    """Whether a function of one sign at two nodes may change it between them: its tangents meet beyond zero."""
    sign = 1.0 if here > 0.0 else -1.0
    turns = sign * fall < 0.0 < sign * rise
    result: bool = turns and min(sign * (here + fall * width), sign * (there - rise * width)) < 0.0
    return result
