"""Crossings, extrema and absolute integrals of functions on panels, exact on the interpolant, for whole batches.

The nodes tell in which interval a feature lies; a safeguarded Newton iteration on the panel's polynomial finds it.
Values are (b, T) on the nodes of a grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.panels import PanelGrid

_ITERATIONS = 60
_RESOLUTION = 1e-13
"""Step in y at which a root counts as found."""


@dataclass(frozen=True)
class Spots:
    """Points between two neighbouring nodes: member, panel and the interval of y, each (r,)."""

    rows: Array
    panels: Array
    low: Floats
    high: Floats

    def take(self, which: Array) -> Spots:
        """Return some of the spots."""
        return Spots(self.rows[which], self.panels[which], self.low[which], self.high[which])


def intervals(grid: PanelGrid, rows: Array, left: Array) -> Spots:
    """Return the spots of members `rows` between the nodes `left` and `left` + 1."""
    return Spots(rows, grid.panel_of_node[left], grid.y[left], grid.y[left + 1])


def roots(grid: PanelGrid, values: Floats, slopes: Floats, spots: Spots, level: Floats | float = 0.0) -> Floats:
    """Return y of a root of values - level in each spot, whose ends have opposite signs.

    Newton's iteration with `slopes` = dvalues/dy, kept inside a bracket that bisection narrows.
    """
    target = np.broadcast_to(np.asarray(level, dtype=np.float64), spots.rows.shape)
    low, high = spots.low.copy(), spots.high.copy()
    f_low = grid.at(spots.rows, spots.panels, low, values)[0] - target
    f_high = grid.at(spots.rows, spots.panels, high, values)[0] - target
    with np.errstate(invalid="ignore", divide="ignore"):
        y = np.where(f_high != f_low, low - f_low * (high - low) / (f_high - f_low), low)
    y = np.clip(np.where(np.isfinite(y), y, low), low, high)
    active = np.arange(len(y))
    for _ in range(_ITERATIONS):
        rows, panels = spots.rows[active], spots.panels[active]
        f, slope = grid.at(rows, panels, y[active], values, slopes)
        f = f - target[active]
        same = (f > 0.0) == (f_low[active] > 0.0)
        low[active], high[active] = np.where(same, y[active], low[active]), np.where(same, high[active], y[active])
        with np.errstate(invalid="ignore", divide="ignore"):
            newton = y[active] - f / slope
        inside = (newton >= low[active]) & (newton <= high[active])
        following = np.where(inside, newton, 0.5 * (low[active] + high[active]))
        moved = np.abs(following - y[active])
        y[active] = np.where(f == 0.0, y[active], following)
        active = active[(f != 0.0) & (moved > _RESOLUTION)]
        if not active.size:
            break
    return y


def last_crossing(grid: PanelGrid, values: Floats, level: float) -> Floats:
    """Return the last time at which |values| = level, (b,): 0 if never above, +inf if above at the end."""
    magnitude = np.abs(values)
    above = magnitude > level
    n = values.shape[1]
    last = n - 1 - np.argmax(above[:, ::-1], axis=1)
    never = ~above.any(axis=1)
    last[never] = 0
    times = np.where(never, 0.0, grid.times[last])
    inner = ~never & (last < n - 1)
    inner[inner] &= grid.panel_of_node[last[inner]] == grid.panel_of_node[last[inner] + 1]
    times[~never & (last == n - 1)] = np.inf
    rows = np.flatnonzero(inner)
    slopes = grid.slope(values)
    signed, signed_slopes = _signed(values, slopes, rows, last[rows])
    spots = intervals(grid, rows, last[rows])
    at = Spots(np.arange(len(rows)), spots.panels, spots.low, spots.high)
    times[rows] = grid.time_at(spots.panels, roots(grid, signed, signed_slopes, at, level))
    return _late_excursions(grid, values, slopes, magnitude, last, times, level)


def _signed(values: Floats, slopes: Floats, rows: Array, nodes: Array) -> tuple[Floats, Floats]:
    sign = np.where(values[rows, nodes] < 0.0, -1.0, 1.0)[:, None]
    return sign * values[rows], sign * slopes[rows]


def _late_excursions(
    grid: PanelGrid, values: Floats, slopes: Floats, magnitude: Floats, last: Array, times: Floats, level: float
) -> Floats:
    """Move the last crossing to where |values| passes the level between two nodes that are both below it."""
    later = np.arange(values.shape[1]) > last[:, None]
    close = np.flatnonzero((np.where(later, magnitude, 0.0).max(axis=1) > 0.4 * level) & np.isfinite(times))
    if not close.size:
        return times
    local = _rising(grid, np.sign(values[close]) * slopes[close])
    local = local.take(np.flatnonzero(grid.time_at(local.panels, local.low) >= grid.times[last[close]][local.rows]))
    moved = Spots(close[local.rows], local.panels, local.low, local.high)
    peak = roots(grid, slopes, grid.slope(slopes), moved)
    height = grid.at(moved.rows, moved.panels, peak, values)[0]
    over = np.flatnonzero(np.abs(height) > level)
    if not over.size:
        return times
    beyond = Spots(moved.rows[over], moved.panels[over], peak[over], moved.high[over])
    sign = np.sign(height[over])[:, None]
    signed, signed_slopes = sign * values[beyond.rows], sign * slopes[beyond.rows]
    at = Spots(np.arange(len(over)), beyond.panels, beyond.low, beyond.high)
    crossing = grid.time_at(beyond.panels, roots(grid, signed, signed_slopes, at, level))
    np.maximum.at(times, beyond.rows, crossing)
    return times


def _rising(grid: PanelGrid, slopes: Floats) -> Spots:
    """Return the intervals in which a function rises at the left node and no longer at the right one."""
    left = grid.left
    rising = slopes > 0.0
    rows, which = np.nonzero(rising[:, left] & ~rising[:, left + 1])
    return intervals(grid, rows, left[which])


def largest_maximum(grid: PanelGrid, values: Floats, with_end: bool) -> Floats:
    """Return the largest local maximum of `values`, (b,), the end of the horizon included on request; 0 at least.

    Meant for excursions: a negative maximum counts as none.
    """
    result = np.maximum(values[:, -1], 0.0) if with_end else np.zeros(len(values))
    slopes = grid.slope(values)
    spots = _rising(grid, slopes)
    reach = _upper_bounds(grid, values, slopes, spots)
    best = np.zeros(len(values))
    nodes = np.maximum.reduce([result, _node_maxima(grid, values, spots, len(values))])
    chosen = np.flatnonzero(reach >= nodes[spots.rows])
    spots = spots.take(chosen)
    if spots.rows.size:
        y = roots(grid, slopes, grid.slope(slopes), spots)
        np.maximum.at(best, spots.rows, grid.at(spots.rows, spots.panels, y, values)[0])
    largest: Floats = np.maximum(result, best)
    return largest


def _node_maxima(grid: PanelGrid, values: Floats, spots: Spots, count: int) -> Floats:
    """Return for each member the largest value at the ends of its spots."""
    ends = np.zeros(count)
    for y in (spots.low, spots.high):
        np.maximum.at(ends, spots.rows, values[spots.rows, _node(grid, spots.panels, y)])
    return ends


def _node(grid: PanelGrid, panels: Array, y: Floats) -> Array:
    """Index of the node at y of a panel."""
    index = np.empty(len(panels), dtype=np.intp)
    for i, (where, _, rule) in enumerate(grid.slices()):
        mine = panels == i
        index[mine] = where.start + np.clip(np.searchsorted(rule.y, y[mine]), 0, len(rule.y) - 1)
    return index


def _upper_bounds(grid: PanelGrid, values: Floats, slopes: Floats, spots: Spots) -> Floats:
    """Bound a concave maximum by the tangents at both ends of its interval."""
    a, b = _node(grid, spots.panels, spots.low), _node(grid, spots.panels, spots.high)
    width = spots.high - spots.low
    from_left = values[spots.rows, a] + slopes[spots.rows, a] * width
    from_right = values[spots.rows, b] - slopes[spots.rows, b] * width
    bound: Floats = np.minimum(from_left, from_right)
    return bound


def absolute_integral(grid: PanelGrid, values: Floats) -> Floats:
    """Return ∫ |values| dt over the grid, (b,), with the sign changes located."""
    pieces = grid.pieces(values)
    total = np.abs(pieces).sum(axis=1)
    left = grid.left
    positive = values > 0.0
    slopes = grid.slope(values)
    rows, which = np.nonzero(positive[:, left] != positive[:, left + 1])
    single = intervals(grid, rows, left[which])
    total += _correction(grid, values, slopes, single, pieces[rows, which], len(values))
    total += _dips(grid, values, slopes, positive, pieces)
    integral: Floats = total
    return integral


def _correction(grid: PanelGrid, values: Floats, slopes: Floats, spots: Spots, pieces: Floats, count: int) -> Floats:
    """Return |I₁| + |I₂| - |I₁ + I₂| summed over members, the spots divided at their sign change."""
    if not spots.rows.size:
        return np.zeros(count)
    y = roots(grid, values, slopes, spots)
    first = _integral(grid, values, spots, y)
    extra = np.abs(first) + np.abs(pieces - first) - np.abs(pieces)
    summed: Floats = np.bincount(spots.rows, extra, minlength=count).astype(np.float64)
    return summed


def _integral(grid: PanelGrid, values: Floats, spots: Spots, y: Floats) -> Floats:
    """Return ∫ values dt from the low end of each spot to y, by Gauss-Legendre quadrature on the panel's polynomial."""
    x, w = np.polynomial.legendre.leggauss(8)
    half = 0.5 * (y - spots.low)
    total = np.zeros(len(y))
    for point, weight in zip(x, w, strict=True):
        here = spots.low + half * (point + 1.0)
        rate = np.empty(len(here))
        for i, panel in enumerate(grid.panels):
            mine = spots.panels == i
            rate[mine] = panel.rate(here[mine])
        total += weight * half * rate * grid.at(spots.rows, spots.panels, here, values)[0]
    return total


def _dips(grid: PanelGrid, values: Floats, slopes: Floats, positive: Array, pieces: Floats) -> Floats:
    """Return the correction of intervals whose ends have one sign while the function has the other between."""
    left = grid.left
    sign = np.where(positive, 1.0, -1.0)
    falls = (sign * slopes)[:, left] < 0.0
    rises = (sign * slopes)[:, left + 1] > 0.0
    rows, which = np.nonzero(falls & rises & (positive[:, left] == positive[:, left + 1]))
    if not rows.size:
        return np.zeros(len(values))
    spots = intervals(grid, rows, left[which])
    lowest = roots(grid, slopes, grid.slope(slopes), spots)
    depth = grid.at(rows, spots.panels, lowest, values)[0] * sign[rows, left[which]]
    through = np.flatnonzero(depth < 0.0)
    spots, lowest, rows, which = spots.take(through), lowest[through], rows[through], which[through]
    before = Spots(rows, spots.panels, spots.low, lowest)
    after = Spots(rows, spots.panels, lowest, spots.high)
    down, up = roots(grid, values, slopes, before), roots(grid, values, slopes, after)
    whole = pieces[rows, which]
    first = _integral(grid, values, before, down)
    last = whole - _integral(grid, values, spots, up)
    extra = np.abs(first) + np.abs(whole - first - last) + np.abs(last) - np.abs(whole)
    summed: Floats = np.bincount(rows, extra, minlength=len(values)).astype(np.float64)
    return summed
