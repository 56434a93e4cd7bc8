"""Compiled loops over members and nodes: determinants of 1×1 and 2×2 matrices and their winding.

An entry of M̃ is Σ_e c_e σ^e: coefficients (b, J) times a table of powers at the nodes of a path, (1, J, P) where
members share the exponents, (b, J, P) otherwise. Real and imaginary parts are separate arrays, so that the inner
loops over nodes become vector instructions.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from fracctl.arrays import Array, Booleans, Floats

LARGEST_CHANGE = 0.5
"""Change of a function over a step, relative to its size at both ends, beyond which the step is doubtful."""

compiled = numba.njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz", "arcp"})


@compiled
def _sum(coefficients: Floats, re: Floats, im: Floats, out_re: Floats, out_im: Floats) -> None:
    """Σ_j c_j (re_j + i im_j) over the nodes of a path."""
    count = len(coefficients)
    a, b = coefficients[0], coefficients[1] if count > 1 else 0.0
    second = 1 if count > 1 else 0
    for n in range(len(out_re)):
        out_re[n] = a * re[0, n] + b * re[second, n]
        out_im[n] = a * im[0, n] + b * im[second, n]
    for j in range(2, count):
        c = coefficients[j]
        for n in range(len(out_re)):
            out_re[n] += c * re[j, n]
            out_im[n] += c * im[j, n]


@compiled
def _turns(re: Floats, im: Floats, order: Array) -> tuple[int, bool]:
    """Counter-clockwise crossings of the negative real axis, and whether a step turned by more than a right angle.

    `order` holds the places of the values in their order along the path.
    """
    turns, ambiguous = 0, False
    here = order[0]
    for n in range(1, len(order)):
        there = order[n]
        if re[here] * re[there] + im[here] * im[there] <= 0.0:
            ambiguous = True
        else:
            area = re[here] * im[there] - re[there] * im[here]
            if (im[here] < 0.0) != (im[there] < 0.0) and area * (im[there] - im[here]) < 0.0:
                turns += 1 if im[there] < 0.0 else -1
        here = there
    return turns, ambiguous


@compiled
def _determinant(entries: Any, i: int, m_re: Floats, m_im: Floats, d_re: Floats, d_im: Floats) -> None:
    """Fill in the four entries (4, P) and the determinant (P,) of member i."""
    for e in range(4):
        c, re, im = entries[e]
        shared = min(i, re.shape[0] - 1)
        _sum(c[i], re[shared], im[shared], m_re[e], m_im[e])
    for n in range(len(d_re)):
        d_re[n] = m_re[0, n] * m_re[3, n] - m_im[0, n] * m_im[3, n]
        d_re[n] -= m_re[1, n] * m_re[2, n] - m_im[1, n] * m_im[2, n]
        d_im[n] = m_re[0, n] * m_im[3, n] + m_im[0, n] * m_re[3, n]
        d_im[n] -= m_re[1, n] * m_im[2, n] + m_im[1, n] * m_re[2, n]


def follow(entries: Any, factor_re: Floats, factor_im: Floats) -> tuple[Array, Booleans, Floats]:
    """Return turns of a determinant times a factor along a path, whether a step is doubtful, its last real part."""
    result: tuple[Array, Booleans, Floats] = (
        _follow_scalar(entries[0], factor_re, factor_im)
        if len(entries) == 1
        else _follow_pair(entries, factor_re, factor_im)
    )
    return result


@compiled
def _follow_scalar(entry: Any, factor_re: Floats, factor_im: Floats) -> tuple[Array, Booleans, Floats]:
    c, re, im = entry
    count, length = len(c), len(factor_re)
    turns, doubtful, last = np.empty(count, np.int64), np.empty(count, np.bool_), np.empty(count)
    d_re, d_im = np.empty(length), np.empty(length)
    for i in range(count):
        shared = min(i, re.shape[0] - 1)
        _sum(c[i], re[shared], im[shared], d_re, d_im)
        turns[i], doubtful[i], last[i] = _followed(d_re, d_im, factor_re, factor_im)
    return turns, doubtful, last


@compiled
def _follow_pair(entries: Any, factor_re: Floats, factor_im: Floats) -> tuple[Array, Booleans, Floats]:
    count, length = len(entries[0][0]), len(factor_re)
    turns, doubtful, last = np.empty(count, np.int64), np.empty(count, np.bool_), np.empty(count)
    m_re, m_im, d_re, d_im = np.empty((4, length)), np.empty((4, length)), np.empty(length), np.empty(length)
    for i in range(count):
        _determinant(entries, i, m_re, m_im, d_re, d_im)
        turns[i], doubtful[i], last[i] = _followed(d_re, d_im, factor_re, factor_im)
    return turns, doubtful, last


@compiled
def _followed(d_re: Floats, d_im: Floats, factor_re: Floats, factor_im: Floats) -> tuple[int, bool, float]:
    """Multiply a determinant by its factor in place and follow its phase; see `winding._counted`."""
    length = len(d_re)
    for n in range(length):
        x, y = d_re[n], d_im[n]
        d_re[n] = x * factor_re[n] - y * factor_im[n]
        d_im[n] = x * factor_im[n] + y * factor_re[n]
    turns, doubtful = _turns(d_re, d_im, np.arange(length))
    size = abs(d_re[0]) + abs(d_im[0])
    change, room = 0.0, np.inf
    for n in range(length - 1):
        following = abs(d_re[n + 1]) + abs(d_im[n + 1])
        step = abs(d_re[n + 1] - d_re[n]) + abs(d_im[n + 1] - d_im[n])
        here = LARGEST_CHANGE * (size + following)
        if max(step, change) > here or step > room:
            doubtful = True
        size, change, room = following, step, here
    return turns, doubtful, d_re[length - 1]
