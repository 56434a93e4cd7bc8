"""Roots and extrema of one polynomial on Chebyshev nodes, compiled.

A polynomial is given by its values at the nodes first … stop - 1 of a node axis; y and the barycentric weights are
those of the whole axis.
"""

from __future__ import annotations

import numba
import numpy as np

from fracctl.arrays import Floats

compiled = numba.njit(cache=True, error_model="numpy")
_summing = numba.njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})


@_summing
def at(y: Floats, weights: Floats, values: Floats, first: int, stop: int, point: float) -> float:
    """Value at `point` of the polynomial through the nodes first … stop - 1 (barycentric form)."""
    above, below = 0.0, 0.0
    for j in range(first, stop):
        share = weights[j] / (point - y[j])
        above += share * values[j]
        below += share
    value: float = above / below
    if value != value:
        for j in range(first, stop):
            if point == y[j]:
                value = values[j]
    return value


@compiled
def _cubic(u: float, f0: float, f1: float, d0: float, d1: float) -> tuple[float, float]:
    """Value and derivative at u in [0, 1] of the cubic with values f0, f1 and derivatives d0, d1 at the ends."""
    a, b = d0 - (f1 - f0), (f1 - f0) - d1
    v = 1.0 - u
    value: float = v * f0 + u * f1 + u * v * (v * a + u * b)
    return value, f1 - f0 + (v - u) * (v * a + u * b) + u * v * (b - a)


@compiled
def _cubic_root(f0: float, f1: float, d0: float, d1: float) -> tuple[float, float]:
    """A root in [0, 1] of the cubic, whose ends have opposite signs, and its derivative there."""
    low, high = 0.0, 1.0
    u: float = f0 / (f0 - f1)
    value, slope = _cubic(u, f0, f1, d0, d1)
    for _ in range(40):
        if (value > 0.0) == (f0 > 0.0):
            low = u
        else:
            high = u
        following = u - value / slope if slope != 0.0 else low
        if not low <= following <= high:
            following = 0.5 * (low + high)
        moved = abs(following - u)
        u = following
        value, slope = _cubic(u, f0, f1, d0, d1)
        if moved < 1e-4:
            break
    return u, slope


@compiled
def node_root(
    y: Floats, weights: Floats, row: Floats, slope: Floats, first: int, stop: int, j: int, level: float, near: float
) -> float:
    """A root of the polynomial minus `level` between the nodes j and j + 1, where it changes sign.

    The cubic of values and slopes at both nodes gives a start, secant steps end once they are shorter than `near`
    times the distance of the nodes, which leaves an error far below that; Ridders' method is the fallback.
    """
    width = y[j + 1] - y[j]
    f0, f1 = row[j] - level, row[j + 1] - level
    u, tangent = _cubic_root(f0, f1, slope[j] * width, slope[j + 1] * width)
    before, f_before = u, 0.0
    for attempt in range(8):
        f = at(y, weights, row, first, stop, y[j] + u * width) - level
        if attempt > 0 and f != f_before:
            tangent = (f - f_before) / (u - before)
        if tangent == 0.0 or not 0.0 <= u - f / tangent <= 1.0:
            break
        before, f_before, u = u, f, u - f / tangent
        if abs(u - before) < near:
            point: float = y[j] + u * width
            return point
    return bracketed_root(y, weights, row, first, stop, y[j], y[j + 1], f0, f1, level)


@compiled
def peak(y: Floats, weights: Floats, row: Floats, slope: Floats, first: int, stop: int, j: int) -> tuple[float, float]:
    """Where the slope vanishes between the nodes j and j + 1, and the value there."""
    width = y[j + 1] - y[j]
    scale = abs(slope[j]) + abs(slope[j + 1])
    point = y[j] + width * abs(slope[j]) / scale if scale > 0.0 else y[j]
    before, f_before = y[j], slope[j]
    for _ in range(6):
        f = at(y, weights, slope, first, stop, point)
        if f == f_before:
            break
        following = point - f * (point - before) / (f - f_before)
        if not y[j] <= following <= y[j + 1]:
            point = bracketed_root(y, weights, slope, first, stop, y[j], y[j + 1], slope[j], slope[j + 1], 0.0)
            break
        before, f_before, point = point, f, following
        if abs(point - before) < 1e-3 * width:
            break
    return point, at(y, weights, row, first, stop, point)


@compiled
def bracketed_root(
    y: Floats,
    weights: Floats,
    values: Floats,
    first: int,
    stop: int,
    low: float,
    high: float,
    f_low: float,
    f_high: float,
    level: float,
) -> float:
    """A root of the polynomial minus `level` between low and high, where it is f_low and f_high (Ridders' method)."""
    if f_low == 0.0:
        return low
    point: float = high
    for _ in range(60):
        middle: float = 0.5 * (low + high)
        f_middle = at(y, weights, values, first, stop, middle) - level
        scale = np.sqrt(f_middle * f_middle - f_low * f_high)
        if scale == 0.0:
            return middle
        following: float = middle + (middle - low) * (1.0 if f_low > f_high else -1.0) * f_middle / scale
        f = at(y, weights, values, first, stop, following) - level
        if f == 0.0 or abs(following - point) < 1e-13:
            return following
        point = following
        if (f_middle > 0.0) != (f > 0.0):
            low, f_low, high, f_high = middle, f_middle, following, f
            if low > high:
                low, f_low, high, f_high = high, f_high, low, f_low
        elif (f_low > 0.0) != (f > 0.0):
            high, f_high = following, f
        else:
            low, f_low = following, f
        if high - low < 1e-13:
            return point
    return point
