"""Largest local maxima of functions on panels, also between the nodes, compiled."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.panels import PanelGrid
from fracctl.polynomials import SWELL, as_rows, comparing, compiled, extremes, over_rows, peak, weighted

_NOISE, _WAVES = 1e-11, 1e-9
"""Rises, relative to the largest magnitude, below which a maximum among nodes, and one between, is rounding."""


def largest_excursion(grid: PanelGrid, values: Floats, side: Floats, with_end: bool) -> Floats:
    """Return the largest local maximum, at least 0, of side · values, or of ± values where side is 0, as (…).

    The end of the horizon counts as a maximum on request; the beginning never does. +inf where the end is NaN.

    Args:
        grid: panels with T nodes in all.
        values: (…, T).
        side: -1, 0 or 1 for each function, (…).
        with_end: whether the value at the end counts.
    """
    largest = _largest_excursions(grid.nodes, grid.offsets, grid.slopes, as_rows(values), side.ravel(), with_end)
    return largest.reshape(values.shape[:-1])


@over_rows
def _largest_excursions(
    nodes: Floats, offsets: Array, slopes: Floats, rows: Floats, side: Floats, with_end: bool
) -> Floats:
    """Largest excursion of each row."""
    largest = np.full(len(rows), np.inf)
    crests = np.empty((2, len(offsets) - 1))
    for i in range(len(rows)):
        if not np.isnan(rows[i, -1]):
            largest[i] = _largest_excursion(nodes, offsets, slopes, rows[i], side[i], with_end, crests)
    return largest


@compiled
def _largest_excursion(
    nodes: Floats, offsets: Array, slopes: Floats, row: Floats, side: float, with_end: bool, crests: Floats
) -> float:
    """Largest excursion of a row; `crests`, (2, P), takes the largest values of each panel on both sides."""
    largest = 0.0
    for panel in range(len(offsets) - 1):
        low, high = extremes(row, offsets[panel], offsets[panel + 1])
        crests[0, panel], crests[1, panel] = high, -low
        largest = max(largest, high, -low)
    best = 0.0
    for k, sign in ((0, 1.0), (1, -1.0)):
        if side != -sign:
            best = max(best, sign * row[-1] if with_end else 0.0)
            for hidden, noise in ((False, _NOISE * largest), (True, _WAVES * largest)):
                for panel in range(len(offsets) - 1):
                    if crests[k, panel] > (best if hidden else best / SWELL):
                        first, stop = offsets[panel], offsets[panel + 1]
                        best = _largest_maximum(nodes, slopes, row, sign, first, stop, hidden, noise, best)
    return best


@compiled
def _largest_maximum(
    nodes: Floats,
    slopes: Floats,
    row: Floats,
    sign: float,
    first: int,
    stop: int,
    hidden: bool,
    noise: float,
    best: float,
) -> float:
    """Largest local maximum of sign · row in a panel, or `best` if that is larger.

    First come nodes above their neighbours. What is higher than all these is on the way down from the start or up to
    the end, where a minimum and a maximum may hide between nodes that fall or rise.
    """
    bar = best if hidden else best / SWELL
    if not (_wavers(row, first, stop, noise) if hidden else _has_top(row, sign, first, stop, bar)):
        return best
    for j in range(first, stop):
        here = sign * row[j]
        if here <= bar:
            continue
        if not hidden:
            left = j if j > first else max(j - 2, 0)
            if not (_is_top(row, sign, first, stop, j) and _stands_out(row, sign, left, here, noise)):
                continue
            if 0 < j < len(row) - 1:
                best = max(best, here)
        slope = sign * weighted(slopes, j, row, first, stop)
        k = j + 1 if slope > 0.0 else j - 1
        if first <= k < stop and sign * row[k] <= here:
            reach = here + slope * (nodes[0, k] - nodes[0, j])
            if reach > best and (not hidden or _stands_out(row, sign, j, reach, noise)):
                height = sign * peak(nodes, row, first, stop, j, k, sign * slope)[1]
                if not hidden or _stands_out(row, sign, min(j, k), height, noise):
                    best = max(best, height)
    return best


@comparing
def _has_top(row: Floats, sign: float, first: int, stop: int, bar: float) -> bool:
    """Whether a node of a panel above `bar` is no lower than its neighbours."""
    count, one = 0, np.uint64(1)
    for j in range(np.uint64(first + 1), np.uint64(stop - 1)):
        here = sign * row[j]
        count += here > bar and here >= sign * row[j - one] and here >= sign * row[j + one]
    return count > 0 or _is_top(row, sign, first, stop, first) or _is_top(row, sign, first, stop, stop - 1)


@compiled
def _is_top(row: Floats, sign: float, first: int, stop: int, j: int) -> bool:
    """Whether sign · row is no lower at the node j than at its neighbours, across the ends of the panel too."""
    before = j - 1 if j > first else max(j - 2, 0)
    after = j + 1 if j + 1 < stop else min(j + 2, len(row) - 1)
    top: bool = sign * row[j] >= sign * row[before] and sign * row[j] >= sign * row[after]
    return top


@comparing
def _wavers(row: Floats, first: int, stop: int, noise: float) -> bool:
    """Whether steps from node to node become shorter and longer again, as they do next to a hidden extremum.

    Near the ends of a panel nodes are 1, 4, 9, … apart from the end; there the first step must be far shorter still.
    """
    count, one = 0, np.uint64(1)
    for j in range(np.uint64(first + 1), np.uint64(stop - 2)):
        k = j + one
        here, before, after = abs(row[k] - row[j]), abs(row[j] - row[j - one]), abs(row[k + one] - row[k])
        count += here <= before and here <= after and before + after > noise
    for end, inner in ((first, 1), (stop - 1, -1)):
        step = abs(row[end + 2 * inner] - row[end + inner])
        count += 6.0 * abs(row[end + inner] - row[end]) < step and step > noise
    return count > 0


@compiled
def _stands_out(row: Floats, sign: float, i: int, height: float, noise: float) -> bool:
    """Whether sign · row falls by more than `noise` below `height` from the node i back to the last one above it."""
    for k in range(i, -1, -1):
        if sign * row[k] < height - noise:
            return True
        if sign * row[k] > height:
            return False
    return False
