"""The phase of a determinant along the imaginary axis, member by member, compiled.

The path leads down the axis, σ = i r, from where the determinant is near its leading power to where it stays in a disc
around its limit at the origin that 0 lies outside of. What is followed is f(σ) / (σ + ρ)^degree, finite at both ends.

A step next to which the function changes by its own size is doubtful: two zeros close to each other and to the path
turn the phase by 2π within a step that they leave no other trace in than this rate of change. Members with such steps
are left to `fracctl.characteristic.doubts`, and so are determinants of
three or more coordinates.
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.determinants import eliminate
from fracctl.compiling import compiled, helper, inlined

COUNTED, DOUBTFUL, SHORT = 0, 1, 2
"""What has come out for a member: a count, doubt, or a path that ends before it reaches the disc."""
LARGEST_CHANGE = 0.5
"""Change of a function over a step, relative to its size at both ends, beyond which the step is doubtful."""
_DISC = 0.9
"""Radius of the disc around the limit, relative to its size."""


@compiled
def zeros_to_the_right(
    coefficients: Floats,
    orders: Floats,
    place: Array,
    degree: Floats,
    limit: Floats,
    sums: Floats,
    line: Floats,
    rho: float,
    gone: int | None,
) -> tuple[Floats, Array, Array]:
    """Count the zeros of a determinant with Re σ > 0.

    Args:
        coefficients: c, (b, K), see `Equation`.
        orders: β, (1, K) or (b, K).
        place: row and column of each power, (K, 2).
        degree: of the determinant at infinity, (1,) or (b,).
        limit: of the determinant at the origin, (b,).
        sums: row sums at the origin, (b, p).
        line: log r at the nodes on the imaginary axis, descending from beyond all zeros.
        rho: log ρ.
        gone: how many coordinates, the last ones, hold no other of them, or None.

    Returns:
        The counts (b,), what has come out (b,), and the last node that a path needs (b,).
    """
    count, terms, size, nodes = len(coefficients), len(place), sums.shape[1], len(line)
    zeros, outcome, lasts = np.zeros(count), np.zeros(count, np.int64), np.zeros(count, np.int64)
    table, reach, factor = np.empty((2 * terms, nodes)), np.empty((terms, nodes)), np.empty((2, nodes))
    kept = size if gone is None else size - gone
    entries, path, work = np.empty((2 * size * size, nodes)), np.empty((2, nodes)), np.empty((2, nodes))
    for i in range(count):
        own = i if len(orders) > 1 else 0
        if i == own:
            _tabulate(orders, own, degree[own], line, rho, table, reach, factor)
        end = _disc(coefficients, i, reach, place, sums, _DISC * abs(limit[i]), lasts[max(i - 1, 0)])
        if end == nodes:
            outcome[i] = SHORT
            continue
        last = min(end + 1, nodes - 1)
        lasts[i] = last
        outcome[i] = DOUBTFUL
        if kept > 2:
            continue
        _evaluate(coefficients, i, table, place, size, last + 1, entries)
        eliminate(entries, last + 1, size, gone)
        _follow(entries, size, kept, last + 1, factor, path)
        if _is_smooth(path, last, work):
            outcome[i] = COUNTED
            turns = 0
            for n in range(last):
                turns += crossing(path[0, n], path[1, n], path[0, n + 1], path[1, n + 1])
            zeros[i] = zeros_from(turns, path[0, last], path[1, last], degree[own], line[last] - rho)
    return zeros, outcome, lasts


@helper
def zeros_from(turns: int, x: float, y: float, degree: float, log_r: float) -> float:
    """Return the count from the crossings of the negative real axis on the path, its last value and radius over ρ."""
    phase = 2.0 * np.pi * turns + (np.arctan2(abs(y), x) if y >= 0.0 else np.arctan2(y, x))
    zeros: float = np.rint((phase + degree * np.arctan(np.exp(log_r))) / np.pi)
    return zeros


@helper
def crossing(x0: float, y0: float, x1: float, y1: float) -> int:
    """1 for a step through the negative real axis counter-clockwise, -1 for one clockwise; less than a right angle."""
    if (y0 < 0.0) == (y1 < 0.0) or (x0 * y1 - x1 * y0) * (y1 - y0) >= 0.0:
        return 0
    return 1 if y1 < 0.0 else -1


@helper
def turned(order: float) -> tuple[float, float]:
    """Real and imaginary part of i^order, exact for whole orders."""
    whole = np.rint(order)
    if order == whole:
        quadrant = int(whole) % 4
        return (1.0 - quadrant if quadrant % 2 == 0 else 0.0), (2.0 - quadrant if quadrant % 2 == 1 else 0.0)
    return np.cos(0.5 * np.pi * order), np.sin(0.5 * np.pi * order)


@helper
def factor_at(log_r: float, degree: float) -> tuple[float, float]:
    """1 / (σ + 1)^degree on the axis, which leads from the determinant to what is followed; σ in units of ρ."""
    r = np.exp(log_r)
    size, angle = np.exp(-0.5 * degree * np.log(1.0 + r * r)), -degree * np.arctan(r)
    return size * np.cos(angle), size * np.sin(angle)


@inlined
def _tabulate(
    orders: Floats, own: int, degree: float, line: Floats, rho: float, table: Floats, reach: Floats, factor: Floats
) -> None:
    """Fill in real and imaginary parts of σ^β, (2 K, nodes), and |σ|^β, (K, nodes), 0 at β = 0; and the factor."""
    for n in range(len(line)):
        factor[0, n], factor[1, n] = factor_at(line[n] - rho, degree)
    for t in range(len(reach)):
        order = orders[own, t]
        x, y = turned(order)
        for n in range(len(line)):
            size = np.exp(order * line[n])
            reach[t, n] = 0.0 if order == 0.0 else size
            table[2 * t, n], table[2 * t + 1, n] = size * x, size * y


@inlined
def _disc(c: Floats, i: int, reach: Floats, place: Array, sums: Floats, radius: float, guess: int) -> int:
    """Return the first node from which on f stays within `radius` of its limit; beyond the last if there is none."""
    nodes, limit = reach.shape[1], 1.0
    for j in range(sums.shape[1]):
        limit *= sums[i, j]
    limit += radius
    end: int = min(guess, nodes - 1)
    while end < nodes and _bound(c, i, reach, place, sums, end) >= limit:
        end += 1
    if end <= guess:
        while end > 0 and _bound(c, i, reach, place, sums, end - 1) < limit:
            end -= 1
    return end


@helper
def _bound(c: Floats, i: int, reach: Floats, place: Array, sums: Floats, n: int) -> float:
    """Π (a_i + e_i) ≥ |det (A + E) - det A| + Π a_i, with the row sums of |A| and |E|; A = M(0), A + E = M(σ)."""
    whole: float = 1.0
    total, row = sums[i, 0], 0
    for t in range(len(place)):
        if place[t, 0] != row:
            row = place[t, 0]
            whole, total = whole * total, sums[i, row]
        total += abs(c[i, t]) * reach[t, n]
    whole *= total
    return whole


@inlined
def _evaluate(c: Floats, i: int, table: Floats, place: Array, size: int, count: int, entries: Floats) -> None:
    """Fill in the entries at the first nodes."""
    for where in range(len(entries)):
        for n in range(count):
            entries[where, n] = 0.0
    for t in range(len(place)):
        where, coefficient = 2 * (size * place[t, 0] + place[t, 1]), c[i, t]
        for n in range(count):
            entries[where, n] += coefficient * table[2 * t, n]
            entries[where + 1, n] += coefficient * table[2 * t + 1, n]


@inlined
def _follow(entries: Floats, size: int, kept: int, count: int, factor: Floats, path: Floats) -> None:
    """Fill in the function at the first nodes, from the entries of one coordinate or two."""
    b, c, d = 2, 2 * size, 2 * size + 2
    for n in range(count):
        x, y = entries[0, n], entries[1, n]
        if kept == 2:
            x, y = (
                x * entries[d, n]
                - y * entries[d + 1, n]
                - entries[b, n] * entries[c, n]
                + entries[b + 1, n] * entries[c + 1, n],
                x * entries[d + 1, n]
                + y * entries[d, n]
                - entries[b, n] * entries[c + 1, n]
                - entries[b + 1, n] * entries[c, n],
            )
        path[0, n] = x * factor[0, n] - y * factor[1, n]
        path[1, n] = x * factor[1, n] + y * factor[0, n]


@inlined
def _is_smooth(path: Floats, steps: int, work: Floats) -> bool:
    """Whether no step is doubtful."""
    for n in range(steps + 1):
        work[0, n] = abs(path[0, n]) + abs(path[1, n])
    for n in range(steps):
        work[1, n] = abs(path[0, n + 1] - path[0, n]) + abs(path[1, n + 1] - path[1, n])
    doubts = 0
    for n in range(steps):
        doubts += not work[1, n] < LARGEST_CHANGE * (work[0, n] + work[0, n + 1])
    for n in range(steps - 1):
        doubts += not work[1, n] < LARGEST_CHANGE * (work[0, n + 1] + work[0, n + 2])
        doubts += not work[1, n + 1] < LARGEST_CHANGE * (work[0, n] + work[0, n + 1])
    return doubts == 0
