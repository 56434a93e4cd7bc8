"""Values, slopes, roots and extrema of the polynomials on the panels of one member, compiled.

`nodes` holds y and the barycentric weights of all nodes of a grid, (2, T), and `row` the values of one function
there; `first` is the first node of a panel and `stop` the node after its last. Sums run over unsigned indices,
which cannot count from the end: with others the compiler does not vectorise them.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from fracctl.arrays import Floats
from fracctl.compiling import compiled_with, helper_with

_inner = partial(helper_with, error_model="numpy", _nrt=False)
"""Of functions that make no arrays: without counting references to those they are given they take 2/3 of the time."""

over_rows = compiled_with(error_model="numpy")
compiled = _inner()
summing = _inner(forceinline=True, fastmath={"reassoc", "contract"})
comparing = _inner(forceinline=True, fastmath={"reassoc", "nnan", "nsz"})

SWELL = 1.5
"""No interpolant that its nodes resolve is larger between them than this times its largest node."""

_INSIDE = 1e-5
"""How far from a node, relative to the distance of the nodes, `taylor` still gives curvatures to five digits."""


def as_rows(values: Floats) -> Floats:
    """All functions as rows (r, T), without a copy where they lie so in memory."""
    return np.ascontiguousarray(values).reshape(-1, values.shape[-1])


@summing
def at(nodes: Floats, row: Floats, first: int, stop: int, point: float) -> float:
    """Value at `point` (barycentric form)."""
    above, below = 0.0, 0.0
    for j in range(np.uint64(first), np.uint64(stop)):
        share = nodes[1, j] / (point - nodes[0, j])
        above += share * row[j]
        below += share
    value: float = above / below
    if value != value:
        for j in range(first, stop):
            if point == nodes[0, j]:
                value = row[j]
    return value


@summing
def taylor(nodes: Floats, row: Floats, first: int, stop: int, point: float) -> tuple[float, float, float]:
    """Value and the first two derivatives at a point away from the nodes.

    With s_k = Σ w_j / (y - y_j)^k and f_k the same sums over w_j f_j, the barycentric form p = f_1 / s_1 gives
    p' = (p s_2 - f_2) / s_1 and p'' = 2 (f_3 - p s_3 + p' s_2) / s_1.
    """
    s1, s2, s3, f1, f2, f3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(np.uint64(first), np.uint64(stop)):
        inverse = 1.0 / (point - nodes[0, j])
        a = nodes[1, j] * inverse
        b = a * inverse
        c = b * inverse
        s1 += a
        s2 += b
        s3 += c
        f1 += a * row[j]
        f2 += b * row[j]
        f3 += c * row[j]
    value = f1 / s1
    slope = (value * s2 - f2) / s1
    return value, slope, 2.0 * (f3 - value * s3 + slope * s2) / s1


@summing
def weighted(matrix: Floats, i: int, row: Floats, first: int, stop: int) -> float:
    """Sum of the values of a panel times the first entries of row i of a matrix."""
    total, offset = 0.0, np.uint64(first)
    for j in range(np.uint64(stop - first)):
        total += matrix[i, j] * row[offset + j]
    return total


@comparing
def extremes(row: Floats, first: int, stop: int) -> tuple[float, float]:
    """Smallest and largest value at the nodes of a panel."""
    low, high = row[first], row[first]
    for j in range(np.uint64(first), np.uint64(stop)):
        value = row[j]
        low = value if value < low else low
        high = value if value > high else high
    return low, high


@compiled
def root(
    nodes: Floats,
    row: Floats,
    first: int,
    stop: int,
    low: float,
    high: float,
    f_low: float,
    f_high: float,
    level: float,
    near: float,
) -> float:
    """A root of the polynomial minus `level` between low and high, where it is f_low and f_high, of opposite signs.

    low < high lie in one interval between two nodes. Halley's steps begin at the secant, with bisection where they
    leave the bracket. With q = f'' / (2 f') a step s leaves an error near s³ (q² - f''' / (6 f')), of which the second
    term is below (high - low)^-2 where the nodes resolve f; what leaves less than near (high - low) is the last step.
    """
    if f_low == 0.0:
        return low
    width = high - low
    left, right, margin = low, high, _INSIDE * width
    point: float = low + width * f_low / (f_low - f_high)
    for _ in range(60):
        point = min(max(point, low + margin), high - margin)
        value, slope, curvature = taylor(nodes, row, first, stop, point)
        value -= level
        if (value > 0.0) == (f_low > 0.0):
            left = point
        else:
            right = point
        following = point - 2.0 * value * slope / (2.0 * slope * slope - value * curvature)
        if left - margin <= following <= right + margin:
            following = min(max(following, left), right)
            bend = 0.5 * curvature * width / slope
            if (abs(following - point) / width) ** 3 * (1.0 + bend * bend) < near:
                return following
            point = following
        else:
            point = 0.5 * (left + right)
            if right - left < margin:
                break
    return point


@compiled
def peak(nodes: Floats, row: Floats, first: int, stop: int, i: int, k: int, slope: float) -> tuple[float, float]:
    """Where the polynomial, which leaves the node i with `slope`, turns before the neighbour k, and its value there.

    It turns since its value at k is no further out than at i. Newton's steps on the slope begin at the vertex of the
    parabola of both values and the slope, with bisection where they leave the bracket.
    """
    origin, width = nodes[0, i], nodes[0, k] - nodes[0, i]
    rise = slope * width
    if rise == 0.0:
        return origin, row[i]
    left, right = 0.0, 1.0
    u: float = 0.5 * rise / (rise + row[i] - row[k])
    value = row[i]
    for _ in range(60):
        u = min(max(u, _INSIDE), 1.0 - _INSIDE)
        value, slope, curvature = taylor(nodes, row, first, stop, origin + u * width)
        step = -slope / (curvature * width)
        if abs(step) < 2e-4:
            return origin + (u + step) * width, value + 0.5 * slope * step * width
        if (slope * width > 0.0) == (rise > 0.0):
            left = u
        else:
            right = u
        if right - left < _INSIDE:
            break
        u = u + step if left < u + step < right else 0.5 * (left + right)
    return origin + u * width, value


@compiled
def time_at(clock: Floats, panel: int, y: float) -> float:
    """Time at y in a panel."""
    start, passed = clock[panel, 0], clock[panel, 1] * (y + 1.0)
    time: float = start * np.exp(passed) if clock[panel, 2] else start + passed
    return time


@compiled
def rate_at(clock: Floats, panel: int, y: float) -> float:
    """dt/dy at y in a panel."""
    scale: float = clock[panel, 1]
    return scale * time_at(clock, panel, y) if clock[panel, 2] else scale
