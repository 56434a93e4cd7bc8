"""Compiled loops that solve M̃(σ) Z̃ = r at the nodes of a contour, for a block of members.

With y = y(0) + z the transform Z of z solves M(σ) Z = r(σ), and M̃ Z̃ = r for Z̃ = σ^ℓ Z. Entries of M̃ and of r are
sums of powers Σ_t c_t σ^e; complex numbers are stored as LANES real parts, then LANES imaginary parts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fracctl.arrays import Array, Booleans, Complexes, Floats
from fracctl.solvers.contour_lanes import LANES, compiled

TERMS = 3
"""Terms of a sum that are added at once; sums are filled up with zeros to a multiple."""
_IMAG = LANES
_PART = 2 * LANES


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
    """r, (p,) sums."""


@compiled
def _sum(powers: Floats, sums: Sums, which: int, coefficients: Floats, out: Floats) -> None:
    """One of the sums at a node, from powers (C, 2), or (C, 2, LANES) if members have exponents of their own."""
    first, stop = sums.edges[which], sums.edges[which + 1]
    if powers.ndim == 2:
        for t in range(first, stop, TERMS):
            a, b, c = powers[sums.columns[t]], powers[sums.columns[t + 1]], powers[sums.columns[t + 2]]
            a_re, b_re, c_re, a_im, b_im, c_im = a[0], b[0], c[0], a[1], b[1], c[1]
            factor = coefficients[t * LANES : (t + TERMS) * LANES]
            if t == first:
                for n in range(LANES):
                    x, y, z = factor[n], factor[LANES + n], factor[2 * LANES + n]
                    out[n] = a_re * x + b_re * y + c_re * z
                    out[_IMAG + n] = a_im * x + b_im * y + c_im * z
            else:
                for n in range(LANES):
                    x, y, z = factor[n], factor[LANES + n], factor[2 * LANES + n]
                    out[n] += a_re * x + b_re * y + c_re * z
                    out[_IMAG + n] += a_im * x + b_im * y + c_im * z
    else:
        out[:] = 0.0
        for t in range(first, stop):
            own, factor = powers[sums.columns[t]], coefficients[t * LANES : (t + 1) * LANES]
            for n in range(LANES):
                out[n] += factor[n] * own[0, n]
                out[_IMAG + n] += factor[n] * own[1, n]


@compiled
def _follow(value: Floats, last: Floats, turns: Floats) -> None:
    """Count crossings of the negative real axis since the `last` value, and steps of a right angle or more.

    Without such steps the phase turns around zero as often as the axis is crossed counter-clockwise.
    """
    for n in range(LANES):
        a, b, x, y = last[n], last[_IMAG + n], value[n], value[_IMAG + n]
        crossed = (b < 0.0) != (y < 0.0) and (a * y - b * x) * (y - b) < 0.0
        turns[n] += (1.0 if y < 0.0 else -1.0) if crossed else 0.0
        turns[LANES + n] += 0.0 if a * x + b * y > 0.0 else 1.0
        last[n], last[_IMAG + n] = x, y


@compiled
def _pair_determinant(m: Floats, det: Floats) -> None:
    """Determinant of M̃₁₁, M̃₁₂, M̃₂₁, M̃₂₂."""
    for n in range(LANES):
        a, b, c, d = m[n], m[_PART + n], m[2 * _PART + n], m[3 * _PART + n]
        a_im, b_im = m[_IMAG + n], m[_PART + _IMAG + n]
        c_im, d_im = m[2 * _PART + _IMAG + n], m[3 * _PART + _IMAG + n]
        det[n] = (a * d - a_im * d_im) - (b * c - b_im * c_im)
        det[_IMAG + n] = (a * d_im + a_im * d) - (b * c_im + b_im * c)


@compiled
def _solve_one(det: Floats, r: Floats) -> None:
    """Replace r by r / M̃."""
    for n in range(LANES):
        x, y, r_re, r_im = det[n], det[_IMAG + n], r[n], r[_IMAG + n]
        scale = 1.0 / (x * x + y * y)
        r[n] = (r_re * x + r_im * y) * scale
        r[_IMAG + n] = (r_im * x - r_re * y) * scale


@compiled
def _solve_pair(m: Floats, det: Floats, r: Floats) -> None:
    """Replace r₁, r₂ by the solution, by Cramer's rule."""
    for n in range(LANES):
        x, y = det[n], det[_IMAG + n]
        scale = 1.0 / (x * x + y * y)
        x, y = x * scale, -y * scale
        a, b, c, d = m[n], m[_PART + n], m[2 * _PART + n], m[3 * _PART + n]
        a_im, b_im = m[_IMAG + n], m[_PART + _IMAG + n]
        c_im, d_im = m[2 * _PART + _IMAG + n], m[3 * _PART + _IMAG + n]
        r_re, r_im, s_re, s_im = r[n], r[_IMAG + n], r[_PART + n], r[_PART + _IMAG + n]
        re = (d * r_re - d_im * r_im) - (b * s_re - b_im * s_im)
        im = (d * r_im + d_im * r_re) - (b * s_im + b_im * s_re)
        r[n], r[_IMAG + n] = re * x - im * y, re * y + im * x
        re = (a * s_re - a_im * s_im) - (c * r_re - c_im * r_im)
        im = (a * s_im + a_im * s_re) - (c * r_im + c_im * r_re)
        r[_PART + n], r[_PART + _IMAG + n] = re * x - im * y, re * y + im * x


@compiled
def _eliminate(size: int, starts: int, m: Floats, det: Floats, r: Floats) -> None:
    """Determinant of three or more coordinates, and r replaced by the solution, member by member."""
    work = np.empty((size, size + starts), np.complex128)
    for n in range(LANES):
        for i in range(size):
            for j in range(size):
                at = (i * size + j) * _PART + n
                work[i, j] = complex(m[at], m[at + _IMAG])
            for j in range(starts):
                at = (j * size + i) * _PART + n
                work[i, size + j] = complex(r[at], r[at + _IMAG])
        product = _reduced(work)
        det[n], det[_IMAG + n] = product.real, product.imag
        for i in range(size):
            for j in range(starts):
                at = (j * size + i) * _PART + n
                r[at], r[at + _IMAG] = work[i, size + j].real, work[i, size + j].imag


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
        sources: coefficients of r from each start, (k, t' LANES).
        odd: out, Z̃ at the odd nodes, (p, 2N, k LANES), real parts first.
        even: out, Z̃ at the even nodes, (p, 2N + 2, k LANES).
        enclosed: set to False for members whose phase turns, (LANES,).
    """
    largest, starts = max(matrix.sizes), len(sources)
    m, r = np.empty(largest * largest * _PART), np.empty(starts * largest * _PART)
    det, last, turns = np.empty(_PART), np.empty(_PART), np.empty(2 * LANES)
    entry = first = 0
    for size in matrix.sizes:
        last[:LANES], last[LANES:], turns[:] = 1.0, 0.0, 0.0
        coordinates = matrix.coordinates[first : first + size]
        for node in range(len(table)):
            wanted = starts if node <= 2 * nodes else 0
            for e in range(size * size):
                _sum(table[node], matrix.entries, entry + e, coefficients, m[e * _PART : (e + 1) * _PART])
            for k in range(wanted):
                for i in range(size):
                    at = (k * size + i) * _PART
                    _sum(table[node], matrix.sources, coordinates[i], sources[k], r[at : at + _PART])
            _solve(size, wanted, m, det, r)
            _follow(det, last, turns)
            for k in range(wanted):
                _write(r[k * size * _PART :], coordinates, odd if node % 2 else even, node // 2, k * LANES)
        for n in range(LANES):
            enclosed[n] &= turns[n] == 0.0 and turns[LANES + n] == 0.0
        entry, first = entry + size * size, first + size


@compiled
def _solve(size: int, starts: int, m: Floats, det: Floats, r: Floats) -> None:
    """Determinant of the entries m of some coordinates, and the right-hand sides r replaced by the solutions."""
    if size == 1:
        det[:] = m[:_PART]
        for k in range(starts):
            _solve_one(det, r[k * _PART : (k + 1) * _PART])
    elif size == 2:
        _pair_determinant(m, det)
        for k in range(starts):
            _solve_pair(m, det, r[2 * k * _PART : 2 * (k + 1) * _PART])
    else:
        _eliminate(size, starts, m, det, r)


@compiled
def _write(solution: Floats, coordinates: Array, out: Floats, node: int, column: int) -> None:
    """Write the solution of one start at one node to rows of Z̃, (p, 2N, k LANES)."""
    for i in range(len(coordinates)):
        target = out[coordinates[i]]
        part = solution[i * _PART : (i + 1) * _PART]
        re, im = target[node, column : column + LANES], target[len(target) // 2 + node, column : column + LANES]
        for n in range(LANES):
            re[n] = part[n]
        for n in range(LANES):
            im[n] = part[_IMAG + n]
