"""Compiled loops over rows of values of a block of members: products, sums, sizes, and the way back to members.

A row holds one number a member, for each of k starts: (k LANES,).
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.solvers.contour_lanes import LANES, compiled, larger


@compiled
def enlarge(largest: Floats, rows: Floats) -> None:
    """Take the magnitudes of all rows into the largest, (k LANES,)."""
    for row in rows:
        for n in range(len(largest)):
            largest[n] = larger(largest[n], abs(row[n]))


@compiled
def enlarge_by_gaps(largest: Floats, rows: Floats, which: Array, others: Floats) -> None:
    """Take the differences between `which` of the rows and others into the largest."""
    for i in range(len(which)):
        row, other = rows[which[i]], others[i]
        for n in range(len(largest)):
            largest[n] = larger(largest[n], abs(row[n] - other[n]))


@compiled
def combine(values: Floats, used: Array, gains: Floats, out: Floats) -> None:
    """Σ_w gains[w] values[w] of the `used` derivatives; values (w, r, k LANES), gains (w, LANES), out (r, k LANES)."""
    out[:] = 0.0
    for r in range(len(out)):
        for k in range(out.shape[1] // LANES):
            target = out[r, k * LANES : (k + 1) * LANES]
            for w in used:
                gain, value = gains[w], values[w, r, k * LANES : (k + 1) * LANES]
                for n in range(LANES):
                    target[n] += gain[n] * value[n]


@compiled
def add_shapes(rows: Floats, shapes: Floats, factors: Floats) -> None:
    """Add factors (k, LANES) times functions of time (r,), or (r, LANES) if members have their own, to rows."""
    for k in range(len(factors)):
        factor = factors[k]
        if np.any(factor):
            for r in range(len(rows)):
                target = rows[r, k * LANES : (k + 1) * LANES]
                if shapes.ndim == 1:
                    shape = shapes[r]
                    for n in range(LANES):
                        target[n] += shape * factor[n]
                else:
                    own = shapes[r]
                    for n in range(LANES):
                        target[n] += own[n] * factor[n]


@compiled
def product(matrix: Floats, rows: Floats, out: Floats) -> None:
    """Product of a matrix (r, e), or of one a member (r, e, LANES), with rows (e, k LANES)."""
    if matrix.ndim == 2:
        np.dot(matrix, rows, out)
    else:
        out[:] = 0.0
        for r in range(len(out)):
            for e in range(len(rows)):
                for n in range(out.shape[1]):
                    out[r, n] += matrix[r, e, n % LANES] * rows[e, n]


@compiled
def times_powers(rows: Floats, table: Floats, first: int, column: int, out: Floats) -> None:
    """Multiply transforms at every other node, real parts first, by powers of the members' own, (P, C, 2, LANES)."""
    count = len(rows) // 2
    if table.ndim == 4:
        for i in range(count):
            power = table[first + 2 * i, column]
            for n in range(rows.shape[1]):
                x, y, re, im = rows[i, n], rows[count + i, n], power[0, n % LANES], power[1, n % LANES]
                out[i, n], out[count + i, n] = x * re - y * im, x * im + y * re


@compiled
def transpose(rows: Floats, first: int, member: int, live: int, out: Floats, column: int) -> None:
    """Write rows as those of `live` members from `member` on, out[:, member:, column, first:]."""
    for k in range(len(out)):
        for begin in range(0, len(rows), 8):
            end = min(begin + 8, len(rows))
            for i in range(live):
                target = out[k, member + i, column, first + begin : first + end]
                for n in range(end - begin):
                    target[n] = rows[begin + n, k * LANES + i]
