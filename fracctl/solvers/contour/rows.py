"""Compiled loops over rows of values of a block of members: products, sums, sizes, and the way back to members.

A row holds one number a member, for each of k starts: (k LANES,).
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.compiling import helper, inlined
from fracctl.solvers.contour.lanes import LANES, WIDTH, larger


@helper
def enlarge(largest: Floats, rows: Floats) -> None:
    """Take the magnitudes of all rows, four at a time, into the largest (k LANES,)."""
    last = len(rows) - 1
    for r in range(0, len(rows), 4):
        s, t, u = min(r + 1, last), min(r + 2, last), min(r + 3, last)
        for n in range(len(largest)):
            a, b = larger(abs(rows[r, n]), abs(rows[s, n])), larger(abs(rows[t, n]), abs(rows[u, n]))
            largest[n] = larger(largest[n], larger(a, b))


@inlined
def enlarge_by_gaps(largest: Floats, which: int, values: Floats, checked: Array, others: Floats, first: int) -> None:
    """Take the differences between the checked rows of values[which] and others[first:] into largest[which]."""
    for i in range(len(checked)):
        r = checked[i]
        for n in range(others.shape[1]):
            largest[which, n] = larger(largest[which, n], abs(values[which, r, n] - others[first + i, n]))


@helper
def combine(values: Floats, used: Array, gains: Floats, control: int, out: Floats) -> None:
    """Σ_u gains[control, u] values[used[u]], two terms at a time.

    Values are (w, r, k LANES), gains (m, u, LANES) with u even, out is (r, k LANES).
    """
    for r in range(values.shape[1]):
        for k in range(out.shape[1] // LANES):
            at = WIDTH * np.uint64(k)
            for u in range(0, len(used), 2):
                v, w = used[u], used[u + 1]
                if u == 0:
                    for n in range(WIDTH):
                        x, y = (
                            gains[control, u, n] * values[v, r, at + n],
                            gains[control, u + 1, n] * values[w, r, at + n],
                        )
                        out[r, at + n] = x + y
                else:
                    for n in range(WIDTH):
                        x, y = (
                            gains[control, u, n] * values[v, r, at + n],
                            gains[control, u + 1, n] * values[w, r, at + n],
                        )
                        out[r, at + n] += x + y


@helper
def add_shapes(rows: Floats, shapes: Floats, factors: Floats) -> None:
    """Add factors (k, LANES) times functions of time (r,), or (r, LANES) if members have their own, to rows."""
    for k in range(len(factors)):
        factor = factors[k]
        size = 0.0
        for n in range(LANES):
            size += abs(factor[n])
        if size != 0.0:
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


@helper
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


@helper
def times_powers(rows: Floats, table: Floats, first: int, column: int, out: Floats) -> None:
    """Multiply transforms at every other node, real parts first, by powers of the members' own, (P, C, 2, LANES)."""
    count = len(rows) // 2
    if table.ndim == 4:
        for i in range(count):
            power = table[first + 2 * i, column]
            for n in range(rows.shape[1]):
                x, y, re, im = rows[i, n], rows[count + i, n], power[0, n % LANES], power[1, n % LANES]
                out[i, n], out[count + i, n] = x * re - y * im, x * im + y * re


@helper
def transpose(rows: Floats, count: int, first: int, member: int, live: int, out: Floats, column: int) -> None:
    """Write `count` rows as those of `live` members from `member` on, out[:, member:, column, first:]."""
    source, target = rows.reshape(-1), out.reshape(-1)
    starts, members, columns, nodes = out.shape
    stride = np.uint64(rows.shape[1])
    for k in range(starts):
        for i in range(live):
            at = np.uint64(k * LANES + i)
            to = np.uint64(((k * members + member + i) * columns + column) * nodes + first)
            for n in range(np.uint64(count)):
                target[to + n] = source[n * stride + at]
