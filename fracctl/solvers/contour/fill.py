"""Compiled loops that solve M̃(σ) Z̃ = r at the nodes of a contour, for a block of members.

With y = y(0) + z the transform Z of z solves M(σ) Z = r(σ), and M̃ Z̃ = r for Z̃ = σ^ℓ Z. Entries of M̃ and of r are
sums of powers Σ_t c_t σ^e; complex numbers are stored as LANES real parts, then LANES imaginary parts.

In blocks [[P, Q], [R, D]] with a diagonal D, as filters and lags make them, D is eliminated first: the other
coordinates solve (P - Q D⁻¹ R) Z̃ = r - Q D⁻¹ r_D. The determinant of that matrix has the zeros of det M̃, as D has none
off the cut, and lies as close to 1 far out: row and column sums of I + N stay below 1 together with those of M̃ - I.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fracctl.arrays import Array, Booleans, Complexes, Floats
from fracctl.compiling import helper, inlined
from fracctl.solvers.contour.lanes import LANES, WIDTH

TERMS = 3
"""Terms of a sum that are added at once; sums are filled up with zeros to a multiple."""
_IMAG, _NEXT, _THIRD = WIDTH, WIDTH, np.uint64(2 * LANES)
_PART = np.uint64(2 * LANES)
_A, _B, _C, _D = (np.uint64(2 * i * LANES) for i in range(4))
_A_IM, _B_IM, _C_IM, _D_IM = (np.uint64((2 * i + 1) * LANES) for i in range(4))


class Sums(NamedTuple):
    """Sums of powers that differ by their coefficients from member to member."""

    columns: Array
    """Column of each term in the table of powers, (t,)."""
    edges: Array
    """First term of each sum, and t."""


class Matrix(NamedTuple):
    """How M̃ falls into blocks of coupled coordinates."""

    blocks: Array
    """Of each block: number of coordinates that are kept, of those eliminated first, the first coordinate and the first
    entry; (blocks, 4)."""
    coordinates: Array
    """The coordinates, block by block, those that are kept before the others, (p,)."""
    entries: Sums
    """Entries, block by block: P row by row, then of each coordinate eliminated its column of Q, its row of R, D."""
    sources: Sums
    """r, in the order of `coordinates`."""
    edges: Array | None
    """Those of `entries`; None where no block has coordinates to eliminate or more than two others. What only these
    need is then not compiled."""


@helper
def _add_up(table: Floats, node: int, sums: Sums, first: int, count: int, coefficients: Floats, out: Floats) -> None:
    """Write some sums at a node, from a table (P, C, 2), or (P, C, 2, LANES) if members have exponents of their own."""
    for i in range(count):
        place = _PART * np.uint64(i)
        if sums.edges[first + i] == sums.edges[first + i + 1]:
            for n in range(_PART):
                out[place + n] = 0.0
        for t in range(sums.edges[first + i], sums.edges[first + i + 1], TERMS):
            begins = t == sums.edges[first + i]
            at = WIDTH * np.uint64(t)
            a, b, c = sums.columns[t], sums.columns[t + 1], sums.columns[t + 2]
            if table.ndim == 3:
                a_re, b_re, c_re = table[node, a, 0], table[node, b, 0], table[node, c, 0]
                a_im, b_im, c_im = table[node, a, 1], table[node, b, 1], table[node, c, 1]
                if begins:
                    for n in range(WIDTH):
                        x, y, z = coefficients[at + n], coefficients[at + _NEXT + n], coefficients[at + _THIRD + n]
                        out[place + n] = a_re * x + b_re * y + c_re * z
                        out[place + _IMAG + n] = a_im * x + b_im * y + c_im * z
                else:
                    for n in range(WIDTH):
                        x, y, z = coefficients[at + n], coefficients[at + _NEXT + n], coefficients[at + _THIRD + n]
                        out[place + n] += a_re * x + b_re * y + c_re * z
                        out[place + _IMAG + n] += a_im * x + b_im * y + c_im * z
            else:
                for n in range(WIDTH):
                    x, y, z = coefficients[at + n], coefficients[at + _NEXT + n], coefficients[at + _THIRD + n]
                    re = table[node, a, 0, n] * x + table[node, b, 0, n] * y + table[node, c, 0, n] * z
                    im = table[node, a, 1, n] * x + table[node, b, 1, n] * y + table[node, c, 1, n] * z
                    out[place + n] = re if begins else out[place + n] + re
                    out[place + _IMAG + n] = im if begins else out[place + _IMAG + n] + im


@inlined
def _follow(value: Floats, last: Floats, turns: Floats) -> None:
    """Count crossings of the negative real axis since the `last` value, and steps of a right angle or more.

    Without such steps the phase turns around zero as often as the axis is crossed counter-clockwise.
    """
    for n in range(WIDTH):
        a, b, x, y = last[n], last[_IMAG + n], value[n], value[_IMAG + n]
        crossed = (b < 0.0) != (y < 0.0) and (a * y - b * x) * (y - b) < 0.0
        turns[n] += (1.0 if y < 0.0 else -1.0) if crossed else 0.0
        turns[_NEXT + n] += 0.0 if a * x + b * y > 0.0 else 1.0
        last[n], last[_IMAG + n] = x, y


@inlined
def _pair_determinant(m: Floats, det: Floats) -> None:
    """Determinant of M̃₁₁, M̃₁₂, M̃₂₁, M̃₂₂."""
    for n in range(WIDTH):
        a, b, c, d = m[_A + n], m[_B + n], m[_C + n], m[_D + n]
        a_im, b_im, c_im, d_im = m[_A_IM + n], m[_B_IM + n], m[_C_IM + n], m[_D_IM + n]
        det[n] = (a * d - a_im * d_im) - (b * c - b_im * c_im)
        det[_IMAG + n] = (a * d_im + a_im * d) - (b * c_im + b_im * c)


@helper
def _multiply(a: Floats, i: int, b: Floats, j: int) -> None:
    """Replace a_i by a_i b_j."""
    at, by = _PART * np.uint64(i), _PART * np.uint64(j)
    for n in range(WIDTH):
        x, y, re, im = a[at + n], a[at + _IMAG + n], b[by + n], b[by + _IMAG + n]
        a[at + n], a[at + _IMAG + n] = x * re - y * im, x * im + y * re


@helper
def _subtract_product(out: Floats, k: int, a: Floats, i: int, b: Floats, j: int) -> None:
    """Subtract a_i b_j from out_k."""
    to, at, by = _PART * np.uint64(k), _PART * np.uint64(i), _PART * np.uint64(j)
    for n in range(WIDTH):
        x, y, re, im = a[at + n], a[at + _IMAG + n], b[by + n], b[by + _IMAG + n]
        out[to + n] -= x * re - y * im
        out[to + _IMAG + n] -= x * im + y * re


@helper
def _invert(a: Floats, i: int) -> None:
    """Replace a_i by 1 / a_i."""
    at = _PART * np.uint64(i)
    for n in range(WIDTH):
        x, y = a[at + n], a[at + _IMAG + n]
        scale = 1.0 / (x * x + y * y)
        a[at + n], a[at + _IMAG + n] = x * scale, -y * scale


@helper
def _eliminate(kept: int, gone: int, edges: Array, entry: int, m: Floats, r: Floats) -> None:
    """Take P to P - Q D⁻¹ R, R to D⁻¹ R and right-hand sides along with them."""
    for k in range(gone):
        column = kept * kept + k * (2 * kept + 1)
        row, diagonal = column + kept, column + 2 * kept
        _invert(m, diagonal)
        for start in range(len(r)):
            _multiply(r[start], kept + k, m, diagonal)
        for j in range(kept):
            if edges[entry + row + j] < edges[entry + row + j + 1]:
                _multiply(m, row + j, m, diagonal)
        for i in range(kept):
            if edges[entry + column + i] < edges[entry + column + i + 1]:
                for start in range(len(r)):
                    _subtract_product(r[start], i, m, column + i, r[start], kept + k)
                for j in range(kept):
                    if edges[entry + row + j] < edges[entry + row + j + 1]:
                        _subtract_product(m, i * kept + j, m, column + i, m, row + j)


@inlined
def _complete(kept: int, gone: int, edges: Array, entry: int, m: Floats, r: Floats) -> None:
    """Solve for what has been eliminated, from what was kept, for one start."""
    for k in range(gone):
        row = kept * kept + k * (2 * kept + 1) + kept
        for j in range(kept):
            if edges[entry + row + j] < edges[entry + row + j + 1]:
                _subtract_product(r, kept + k, m, row + j, r, j)


@inlined
def _solve_one(det: Floats, r: Floats) -> None:
    """Replace r by r / M̃."""
    for n in range(WIDTH):
        x, y, r_re, r_im = det[n], det[_IMAG + n], r[n], r[_IMAG + n]
        scale = 1.0 / (x * x + y * y)
        r[n] = (r_re * x + r_im * y) * scale
        r[_IMAG + n] = (r_im * x - r_re * y) * scale


@inlined
def _solve_pair(m: Floats, det: Floats, r: Floats) -> None:
    """Replace r₁, r₂ by the solution, by Cramer's rule."""
    for n in range(WIDTH):
        x, y = det[n], det[_IMAG + n]
        scale = 1.0 / (x * x + y * y)
        x, y = x * scale, -y * scale
        a, b, c, d = m[_A + n], m[_B + n], m[_C + n], m[_D + n]
        a_im, b_im, c_im, d_im = m[_A_IM + n], m[_B_IM + n], m[_C_IM + n], m[_D_IM + n]
        r_re, r_im, s_re, s_im = r[_A + n], r[_A_IM + n], r[_B + n], r[_B_IM + n]
        re = (d * r_re - d_im * r_im) - (b * s_re - b_im * s_im)
        im = (d * r_im + d_im * r_re) - (b * s_im + b_im * s_re)
        r[_A + n], r[_A_IM + n] = re * x - im * y, re * y + im * x
        re = (a * s_re - a_im * s_im) - (c * r_re - c_im * r_im)
        im = (a * s_im + a_im * s_re) - (c * r_im + c_im * r_re)
        r[_B + n], r[_B_IM + n] = re * x - im * y, re * y + im * x


@helper
def _solve_many(size: int, m: Floats, det: Floats, r: Floats) -> None:
    """Determinant of three or more coordinates, and r (k, …) replaced by the solutions, member by member."""
    starts = len(r)
    work = np.empty((size, size + starts), np.complex128)
    for n in range(LANES):
        for i in range(size):
            at = 2 * LANES * i + n
            for j in range(size):
                entry = 2 * LANES * (i * size + j) + n
                work[i, j] = complex(m[entry], m[entry + LANES])
            for j in range(starts):
                work[i, size + j] = complex(r[j, at], r[j, at + LANES])
        product = _reduced(work)
        det[n], det[LANES + n] = product.real, product.imag
        for i in range(size):
            at = 2 * LANES * i + n
            for j in range(starts):
                r[j, at], r[j, at + LANES] = work[i, size + j].real, work[i, size + j].imag


@helper
def _reduced(work: Complexes) -> complex:
    """Turn a matrix and right-hand sides (s, s + k) into unit matrix and solutions; return the determinant."""
    size, width = work.shape
    product = 1.0 + 0.0j
    for i in range(size):
        pivot = i
        for row in range(i + 1, size):
            pivot = row if abs(work[row, i]) > abs(work[pivot, i]) else pivot
        product *= work[pivot, i] if pivot == i else -work[pivot, i]
        inverse = 1.0 / work[pivot, i]
        for j in range(i, width):
            work[pivot, j], work[i, j] = work[i, j], work[pivot, j] * inverse
        for row in range(size):
            if row != i:
                factor = work[row, i]
                for j in range(i, width):
                    work[row, j] -= factor * work[i, j]
    return product


@helper
def _solve(kept: int, gone: int, edges: Array | None, entry: int, m: Floats, det: Floats, r: Floats) -> None:
    """Determinant of what is kept of a block, and r (k, …) replaced by the solutions."""
    if edges is not None:
        _eliminate(kept, gone, edges, entry, m, r)
    if kept == 1:
        for n in range(_PART):
            det[n] = m[n]
        for k in range(len(r)):
            _solve_one(det, r[k])
    elif kept == 2:
        _pair_determinant(m, det)
        for k in range(len(r)):
            _solve_pair(m, det, r[k])
    elif edges is not None:
        _solve_many(kept, m, det, r)
    if edges is not None:
        for k in range(len(r)):
            _complete(kept, gone, edges, entry, m, r[k])


@helper
def fill(
    matrix: Matrix,
    table: Floats,
    nodes: int,
    coefficients: Floats,
    sources: Floats,
    odd: Floats,
    even: Floats,
    enclosed: Booleans,
) -> None:
    """Solve for one block of members at the nodes of one contour, and follow the phase of determinants along it.

    Args:
        matrix: structure of the equations.
        table: powers along the contour, (P, C, 2) or (P, C, 2, LANES).
        nodes: N; the first 2N + 1 nodes want solutions.
        coefficients: of the entries, (t LANES,).
        sources: coefficients of r from each start, (k, t' LANES).
        odd: out, Z̃ at the odd nodes, (p, 2N, k LANES), real parts first.
        even: out, Z̃ at the even nodes, (p, 2N + 2, k LANES).
        enclosed: set to False for members whose phase turns, (LANES,).
    """
    starts, most, rows = len(sources), 0, 0
    for kept, gone, _, _ in matrix.blocks:
        most, rows = max(most, kept * kept + gone * (2 * kept + 1)), max(rows, kept + gone)
    m, r = np.empty(most * 2 * LANES), np.empty((starts, rows * 2 * LANES))
    det, last, turns = np.empty(2 * LANES), np.empty(2 * LANES), np.empty(2 * LANES)
    for block in range(len(matrix.blocks)):
        size, extra, first, entry = matrix.blocks[block]
        count = size * size + extra * (2 * size + 1)
        last[:LANES], last[LANES:], turns[:] = 1.0, 0.0, 0.0
        for node in range(len(table)):
            wanted = starts if node <= 2 * nodes else 0
            _add_up(table, node, matrix.entries, entry, count, coefficients, m)
            for k in range(wanted):
                _add_up(table, node, matrix.sources, first, size + extra, sources[k], r[k])
            _solve(size, extra, matrix.edges, entry, m, det, r[:wanted])
            _follow(det, last, turns)
            for k in range(wanted):
                _write(r[k], matrix.coordinates[first : first + size + extra], odd if node % 2 else even, node // 2, k)
        for n in range(LANES):
            enclosed[n] &= turns[n] == 0.0 and turns[LANES + n] == 0.0


@inlined
def _write(solution: Floats, coordinates: Array, out: Floats, node: int, start: int) -> None:
    """Write the solution of a start at one node to rows of Z̃, (p, 2N, k LANES)."""
    to, imaginary = WIDTH * np.uint64(start), out.shape[1] // 2 + node
    for i in range(len(coordinates)):
        at = _PART * np.uint64(i)
        for n in range(WIDTH):
            out[coordinates[i], node, to + n] = solution[at + n]
        for n in range(WIDTH):
            out[coordinates[i], imaginary, to + n] = solution[at + _IMAG + n]
