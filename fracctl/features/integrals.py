"""Integrals of the absolute value of functions on panels, with every change of sign located, compiled."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.panels import PanelGrid
from fracctl.polynomials import as_rows, at, comparing, compiled, extremes, over_rows, peak, rate_at, root, weighted

_ERROR = 1e-3
"""Bound of the error of a change of sign, in distances of nodes; the integral feels its square."""

_SHALLOW = 0.25
"""Share of the largest node of a panel beyond which no resolved interpolant dips to 0 between nodes of one sign."""


def absolute_integral(grid: PanelGrid, values: Floats) -> Floats:
    """Return ∫ |values| dt over the grid for values (…, T), with every change of sign located, as (…).

    +inf where the end is NaN.
    """
    totals = _absolute_integrals(grid.nodes, grid.offsets, grid.slopes, grid.integrals, grid.clock, as_rows(values))
    return totals.reshape(values.shape[:-1])


@over_rows
def _absolute_integrals(
    nodes: Floats, offsets: Array, slopes: Floats, integrals: Floats, clock: Floats, rows: Floats
) -> Floats:
    """∫ |values| of each row."""
    totals = np.full(len(rows), np.inf)
    for i in range(len(rows)):
        if not np.isnan(rows[i, -1]):
            totals[i] = _absolute_integral(nodes, offsets, slopes, integrals, clock, rows[i])
    return totals


@compiled
def _absolute_integral(
    nodes: Floats, offsets: Array, slopes: Floats, integrals: Floats, clock: Floats, row: Floats
) -> float:
    """∫ |values| of a row."""
    total = 0.0
    for panel in range(len(offsets) - 1):
        first, stop = offsets[panel], offsets[panel + 1]
        low, high = extremes(row, first, stop)
        mark = 0.0
        if low <= 0.0 <= high:
            for j in range(first, stop - 1):
                here, there = row[j], row[j + 1]
                if (here > 0.0) != (there > 0.0):
                    zero = root(nodes, row, first, stop, nodes[0, j], nodes[0, j + 1], here, there, 0.0, _ERROR)
                    reached = _integral_to(nodes, integrals, clock, row, first, stop, panel, j, zero)
                    total += abs(reached - mark)
                    mark = reached
                    for i in (j, j + 1):
                        total += _dip(nodes, slopes, integrals, clock, row, first, stop, panel, i)
        total += abs(weighted(integrals, stop - 1, row, first, stop) - mark)
        bar = _SHALLOW * max(high, -low)
        if low < bar and high > -bar and _has_low(row, first, stop, bar):
            for i in range(first, stop):
                if _is_low(row, first, stop, i, bar):
                    total += _dip(nodes, slopes, integrals, clock, row, first, stop, panel, i)
    return total


@comparing
def _has_low(row: Floats, first: int, stop: int, bar: float) -> bool:
    """Whether a node of a panel is `_is_low`."""
    count, one = 0, np.uint64(1)
    for j in range(np.uint64(first + 1), np.uint64(stop - 1)):
        here, before, after = abs(row[j]), row[j] * row[j - one], row[j] * row[j + one]
        count += here < bar and before >= here * here and after >= here * here
    return count > 0 or _is_low(row, first, stop, first, bar) or _is_low(row, first, stop, stop - 1, bar)


@compiled
def _is_low(row: Floats, first: int, stop: int, j: int, bar: float) -> bool:
    """Whether |row| is below `bar` and no larger at the node j than its neighbours in the panel, of the same sign."""
    here = row[j]
    low: bool = abs(here) < bar and (j == first or here * row[j - 1] >= here * here)
    return low and (j + 1 == stop or here * row[j + 1] >= here * here)


@compiled
def _dip(
    nodes: Floats,
    slopes: Floats,
    integrals: Floats,
    clock: Floats,
    row: Floats,
    first: int,
    stop: int,
    panel: int,
    i: int,
) -> float:
    """What ∫ |values| gains by two changes of sign between the node i and a neighbour of the same sign further out."""
    slope = weighted(slopes, i, row, first, stop)
    k = i + 1 if slope * row[i] < 0.0 else i - 1
    if k < first or k >= stop or row[i] * row[k] < row[i] * row[i]:
        return 0.0
    width = nodes[0, k] - nodes[0, i]
    if row[i] * (row[i] + slope * width) >= 0.0:
        other = weighted(slopes, k, row, first, stop)
        if row[i] * (row[k] - other * width) >= 0.0:
            return 0.0
    place, bottom = peak(nodes, row, first, stop, i, k, slope)
    if bottom * row[i] >= 0.0:
        return 0.0
    j = min(i, k)
    down = root(nodes, row, first, stop, nodes[0, j], place, row[j], bottom, 0.0, _ERROR)
    up = root(nodes, row, first, stop, place, nodes[0, j + 1], bottom, row[j + 1], 0.0, _ERROR)
    start = _integral_to(nodes, integrals, clock, row, first, stop, panel, j, down)
    return 2.0 * abs(_integral_to(nodes, integrals, clock, row, first, stop, panel, j, up) - start)


@compiled
def _integral_to(
    nodes: Floats,
    integrals: Floats,
    clock: Floats,
    row: Floats,
    first: int,
    stop: int,
    panel: int,
    j: int,
    zero: float,
) -> float:
    """Integral from the start of a panel to a zero between the nodes j and j + 1.

    From the nearer node Gauss's rule of three points; an error of the zero counts with its square.
    """
    y = nodes[0, j] if 2.0 * zero < nodes[0, j] + nodes[0, j + 1] else nodes[0, j + 1]
    half = 0.5 * (zero - y)
    total = 0.0
    for place, weight in ((-np.sqrt(0.6), 5.0), (0.0, 8.0), (np.sqrt(0.6), 5.0)):
        point = y + half * (1.0 + place)
        total += weight / 9.0 * at(nodes, row, first, stop, point) * rate_at(clock, panel, point)
    reached: float = weighted(integrals, j if y == nodes[0, j] else j + 1, row, first, stop) + half * total
    return reached
