"""Compiled loops that solve M̃(σ) Z̃ = r at the nodes of a contour, for a block of members.

With y = y(0) + z the transform Z of z solves M(σ) Z = r(σ), and M̃ Z̃ = r for Z̃ = σ^ℓ Z. Entries of M̃ and of r are
sums of powers Σ_t c_t σ^e; complex numbers are stored as LANES real parts, then LANES imaginary parts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fracctl.arrays import Array, Booleans, Complexes, Floats
from fracctl.solvers.contour_lanes import LANES, WIDTH, compiled

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

    sizes: Array
    """Number of coordinates of each block."""
    coordinates: Array
    """The coordinates, block by block, (p,)."""
    entries: Sums
    """Entries, block by block and row by row."""
    sources: Sums
    """r, in the order of `coordinates`."""


@compiled
def _add_up(
    table: Floats, node: int, sums: Sums, first: int, count: int, coefficients: Floats, start: int, out: Floats, to: int
) -> None:
    """Write some sums at a node to out[to PART:], with the coefficients of a start of them.

    The table is (P, C, 2), or (P, C, 2, LANES) if members have exponents of their own.
    """
    offset = start * sums.edges[-1]
    for i in range(count):
        place = _PART * np.uint64(to + i)
        for t in range(sums.edges[first + i], sums.edges[first + i + 1], TERMS):
            begins = t == sums.edges[first + i]
            at = WIDTH * np.uint64(offset + t)
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


@compiled
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


@compiled
def _pair_determinant(m: Floats, det: Floats) -> None:
    """Determinant of M̃₁₁, M̃₁₂, M̃₂₁, M̃₂₂."""
    for n in range(WIDTH):
        a, b, c, d = m[_A + n], m[_B + n], m[_C + n], m[_D + n]
        a_im, b_im, c_im, d_im = m[_A_IM + n], m[_B_IM + n], m[_C_IM + n], m[_D_IM + n]
        det[n] = (a * d - a_im * d_im) - (b * c - b_im * c_im)
        det[_IMAG + n] = (a * d_im + a_im * d) - (b * c_im + b_im * c)


@compiled
def _solve(size: int, m: Floats, det: Floats, r: Floats, start: int) -> None:
    """Replace r of a start by the solution for one or two coordinates."""
    if size == 1:
        _solve_one(det, r, start)
    elif size == 2:
        _solve_pair(m, det, r, start)


@compiled
def _solve_one(det: Floats, r: Floats, start: int) -> None:
    """Replace r by r / M̃."""
    at = _PART * np.uint64(start)
    for n in range(WIDTH):
        x, y, r_re, r_im = det[n], det[_IMAG + n], r[at + n], r[at + _IMAG + n]
        scale = 1.0 / (x * x + y * y)
        r[at + n] = (r_re * x + r_im * y) * scale
        r[at + _IMAG + n] = (r_im * x - r_re * y) * scale


@compiled
def _solve_pair(m: Floats, det: Floats, r: Floats, start: int) -> None:
    """Replace r₁, r₂ by the solution, by Cramer's rule."""
    at = _PART * np.uint64(2 * start)
    for n in range(WIDTH):
        x, y = det[n], det[_IMAG + n]
        scale = 1.0 / (x * x + y * y)
        x, y = x * scale, -y * scale
        a, b, c, d = m[_A + n], m[_B + n], m[_C + n], m[_D + n]
        a_im, b_im, c_im, d_im = m[_A_IM + n], m[_B_IM + n], m[_C_IM + n], m[_D_IM + n]
        r_re, r_im, s_re, s_im = r[at + _A + n], r[at + _A_IM + n], r[at + _B + n], r[at + _B_IM + n]
        re = (d * r_re - d_im * r_im) - (b * s_re - b_im * s_im)
        im = (d * r_im + d_im * r_re) - (b * s_im + b_im * s_re)
        r[at + _A + n], r[at + _A_IM + n] = re * x - im * y, re * y + im * x
        re = (a * s_re - a_im * s_im) - (c * r_re - c_im * r_im)
        im = (a * s_im + a_im * s_re) - (c * r_im + c_im * r_re)
        r[at + _B + n], r[at + _B_IM + n] = re * x - im * y, re * y + im * x


@compiled
def _eliminate(size: int, starts: int, m: Floats, det: Floats, r: Floats) -> None:
    """Determinant of three or more coordinates, and r replaced by the solution, member by member."""
    work = np.empty((size, size + starts), np.complex128)
    for n in range(LANES):
        for i in range(size):
            for j in range(size):
                at = 2 * LANES * (i * size + j) + n
                work[i, j] = complex(m[at], m[at + LANES])
            for j in range(starts):
                at = 2 * LANES * (j * size + i) + n
                work[i, size + j] = complex(r[at], r[at + LANES])
        product = _reduced(work)
        det[n], det[LANES + n] = product.real, product.imag
        for i in range(size):
            for j in range(starts):
                at = 2 * LANES * (j * size + i) + n
                r[at], r[at + LANES] = work[i, size + j].real, work[i, size + j].imag


@compiled
def _reduced(work: Complexes) -> complex:
    """Turn a matrix and right-hand sides (s, s + k) into unit matrix and solutions; return the determinant."""
    size, width = work.shape
    product = 1.0 + 0.0j
    for i in range(size):
        pivot = i + np.argmax(np.abs(work[i:, i]))
        if pivot != i:
            product = -product
            for j in range(i, width):
                work[i, j], work[pivot, j] = work[pivot, j], work[i, j]
        product *= work[i, i]
        work[i, i + 1 :] /= work[i, i]
        for row in range(size):
            if row != i:
                work[row, i + 1 :] -= work[row, i] * work[i, i + 1 :]
    return product


@compiled
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
    """Solve for one block of members at the nodes of one contour, and follow the phase of det M̃ along it.

    Args:
        matrix: structure of the equations.
        table: powers along the contour, (P, C, 2) or (P, C, 2, LANES).
        nodes: N; the first 2N + 1 nodes want solutions.
        coefficients: of the entries, (t LANES,).
        sources: coefficients of r, one start after the other, (k t' LANES,).
        odd: out, Z̃ at the odd nodes, (p, 2N, k LANES), real parts first.
        even: out, Z̃ at the even nodes, (p, 2N + 2, k LANES).
        enclosed: set to False for members whose phase turns, (LANES,).
    """
    largest, starts = max(matrix.sizes), odd.shape[2] // LANES
    m, r = np.empty(largest * largest * 2 * LANES), np.empty(starts * largest * 2 * LANES)
    det, last, turns = np.empty(2 * LANES), np.empty(2 * LANES), np.empty(2 * LANES)
    entry = first = 0
    for size in matrix.sizes:
        last[:LANES], last[LANES:], turns[:] = 1.0, 0.0, 0.0
        for node in range(len(table)):
            wanted = starts if node <= 2 * nodes else 0
            entries = det if size == 1 else m
            _add_up(table, node, matrix.entries, entry, size * size, coefficients, 0, entries, 0)
            for k in range(wanted):
                _add_up(table, node, matrix.sources, first, size, sources, k, r, k * size)
            if size == 2:
                _pair_determinant(m, det)
            elif size > 2:
                _eliminate(size, wanted, m, det, r)
            _follow(det, last, turns)
            for k in range(wanted):
                _solve(size, m, det, r, k)
                for i in range(size):
                    _write(r, k * size + i, odd if node % 2 else even, matrix.coordinates[first + i], node // 2, k)
        for n in range(LANES):
            enclosed[n] &= turns[n] == 0.0 and turns[LANES + n] == 0.0
        entry, first = entry + size * size, first + size


@compiled
def _write(solutions: Floats, which: int, out: Floats, coordinate: int, node: int, start: int) -> None:
    """Write one of the solutions at one node to rows of Z̃, (p, 2N, k LANES)."""
    at, to, imaginary = _PART * np.uint64(which), WIDTH * np.uint64(start), out.shape[1] // 2 + node
    for n in range(WIDTH):
        out[coordinate, node, to + n] = solutions[at + n]
    for n in range(WIDTH):
        out[coordinate, imaginary, to + n] = solutions[at + _IMAG + n]
