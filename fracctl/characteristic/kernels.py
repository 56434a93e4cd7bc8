"""Compiled loops over members and nodes: determinants of 1×1 and 2×2 matrices, their winding, and solutions.

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
def _enclosed(re: Floats, im: Floats, layout: Array, order: Array) -> bool:
    """Whether the phase does not turn along any of the paths, and each begins with a positive value."""
    for w in range(len(layout)):
        first = layout[w, 0]
        stop = layout[w + 1, 0] if w + 1 < len(layout) else len(re)
        turns, ambiguous = _turns(re, im, order[first:stop])
        if turns != 0 or ambiguous or re[order[first]] <= 0.0:
            return False
    return True


@compiled
def _split(re: Floats, im: Floats, layout: Array, odd: Floats, even: Floats) -> None:
    """Write the values at the odd and at the even nodes of each path, real parts first."""
    at = 0
    for w in range(len(layout)):
        first, nodes = layout[w, 0], layout[w, 1]
        start = at + 2 * w
        for n in range(nodes):
            odd[at + n] = re[first + n]
            odd[at + nodes + n] = im[first + n]
        for n in range(nodes + 1):
            even[start + n] = re[first + nodes + n]
            even[start + nodes + 1 + n] = im[first + nodes + n]
        at += 2 * nodes


@compiled
def _invert(re: Floats, im: Floats) -> None:
    """Replace values by their reciprocals."""
    for n in range(len(re)):
        scale = 1.0 / (re[n] * re[n] + im[n] * im[n])
        re[n] *= scale
        im[n] *= -scale


@compiled
def solve_scalar(entry: Any, source: Any, layout: Array, order: Array, odd: Floats, even: Floats) -> Booleans:
    """Solve M̃ Z̃ = r for one coordinate at the interlaced nodes of several paths.

    Args:
        entry: coefficients (b, J), real and imaginary powers (1 or b, J, P).
        source: the same for r, coefficients (k, b, Q).
        layout: first node and N of each path, (W, 2); a path begins with its N odd and its N + 1 even nodes.
        order: places of the nodes in the order along the paths, (P,).
        odd: out, (1, k, b, Σ 2N), real parts then imaginary parts of each path.
        even: out, (1, k, b, Σ (2N + 2)).

    Returns:
        Whether the phase of M̃ does not turn along any path, (b,).
    """
    c, re, im = entry
    s, s_re, s_im = source
    count, length = len(c), re.shape[2]
    enclosed = np.empty(count, np.bool_)
    d_re, d_im, r_re, r_im = np.empty(length), np.empty(length), np.empty(length), np.empty(length)
    for i in range(count):
        shared, own = min(i, re.shape[0] - 1), min(i, s_re.shape[0] - 1)
        _sum(c[i], re[shared], im[shared], d_re, d_im)
        enclosed[i] = _enclosed(d_re, d_im, layout, order)
        _invert(d_re, d_im)
        for k in range(len(s)):
            _sum(s[k, i], s_re[own], s_im[own], r_re, r_im)
            for n in range(length):
                x, y = r_re[n] * d_re[n] - r_im[n] * d_im[n], r_re[n] * d_im[n] + r_im[n] * d_re[n]
                r_re[n], r_im[n] = x, y
            _split(r_re, r_im, layout, odd[0, k, i], even[0, k, i])
    return enclosed


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


@compiled
def solve_pair(entries: Any, sources: Any, layout: Array, order: Array, odd: Floats, even: Floats) -> Booleans:
    """Solve M̃ Z̃ = r for two coordinates; `entries` holds M̃₁₁, M̃₁₂, M̃₂₁, M̃₂₂ and `sources` r₁, r₂, as above."""
    count, length = len(entries[0][0]), entries[0][1].shape[2]
    enclosed = np.empty(count, np.bool_)
    m_re, m_im = np.empty((4, length)), np.empty((4, length))
    d_re, d_im = np.empty(length), np.empty(length)
    r_re, r_im = np.empty((2, length)), np.empty((2, length))
    z_re, z_im = np.empty(length), np.empty(length)
    for i in range(count):
        _determinant(entries, i, m_re, m_im, d_re, d_im)
        enclosed[i] = _enclosed(d_re, d_im, layout, order)
        _invert(d_re, d_im)
        for k in range(len(sources[0][0])):
            for row in range(2):
                s, s_re, s_im = sources[row]
                own = min(i, s_re.shape[0] - 1)
                _sum(s[k, i], s_re[own], s_im[own], r_re[row], r_im[row])
            for row in range(2):
                plus, minus, other = 3 - 3 * row, 1 + row, 1 - row
                for n in range(length):
                    x = m_re[plus, n] * r_re[row, n] - m_im[plus, n] * r_im[row, n]
                    x -= m_re[minus, n] * r_re[other, n] - m_im[minus, n] * r_im[other, n]
                    y = m_re[plus, n] * r_im[row, n] + m_im[plus, n] * r_re[row, n]
                    y -= m_re[minus, n] * r_im[other, n] + m_im[minus, n] * r_re[other, n]
                    z_re[n] = x * d_re[n] - y * d_im[n]
                    z_im[n] = x * d_im[n] + y * d_re[n]
                _split(z_re, z_im, layout, odd[row, k, i], even[row, k, i])
    return enclosed


def solve(entries: Any, sources: Any, layout: Array, order: Array, odd: Floats, even: Floats) -> Booleans:
    """Solve one or two coordinates; see `solve_scalar` and `solve_pair`."""
    enclosed: Booleans
    if len(sources) == 1:
        enclosed = solve_scalar(entries[0], sources[0], layout, order, odd, even)
    else:
        enclosed = solve_pair(entries, sources, layout, order, odd, even)
    return enclosed


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
