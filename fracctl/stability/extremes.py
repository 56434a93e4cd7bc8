"""Roots and maxima of functions of frequency, for many members at a time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fracctl.arrays import Array, Booleans, Floats

Curve = Callable[[Floats, Array], Floats]
"""f(ω, rows): frequencies (1, k) or (n, k) of the members `rows` (n,), values (n, k)."""

_HALVINGS, _SECTIONS = 48, 44
"""Steps of bisection and of the golden section: to rounding from neighbours on the grid."""
_TOUCHING = 0.1
"""A curve this near to 0 may cross it twice between neighbours."""
_NEAR_LARGEST = 0.7
"""Local maxima this near to the largest value on the grid are looked at closely."""
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


def roots(curve: Curve, omega: Floats, values: Floats) -> tuple[Array, Floats]:
    """Find where curves cross 0.

    Args:
        curve: of scale 1, continuous up to changes of sign.
        omega: the grid, (k,).
        values: of the curve on it, (n, k).

    Returns:
        The member of each root, and the root.
    """
    sign = np.sign(values)
    members, places = np.nonzero(sign[:, :-1] * sign[:, 1:] < 0.0)
    lower, upper = omega[places], omega[places + 1]
    below = sign[members, places]
    near, at, turn = _turns(curve, omega, values, sign)
    beyond = np.sign(curve(turn[:, None], near)[:, 0]) * sign[near, at] < 0.0
    near, at, turn = near[beyond], at[beyond], turn[beyond]
    members = np.concatenate([members, near, near])
    lower, upper = np.concatenate([lower, omega[at - 1], turn]), np.concatenate([upper, turn, omega[at + 1]])
    below = np.concatenate([below, sign[near, at], -sign[near, at]])
    for _ in range(_HALVINGS if members.size else 0):
        middle = np.sqrt(lower * upper)
        first = np.sign(curve(middle[:, None], members)[:, 0]) == below
        lower, upper = np.where(first, middle, lower), np.where(first, upper, middle)
    exactly, places = np.nonzero(sign == 0.0)
    return np.concatenate([members, exactly]), np.concatenate([np.sqrt(lower * upper), omega[places]])


def largest(curve: Curve, omega: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the largest value of each curve and where it has it, (n,) each; arguments as for `roots`."""
    best = values.argmax(axis=1)
    rows = np.arange(len(values))
    value, where = values[rows, best], omega[best]
    members, places = np.nonzero(_peaks(values) & (values[:, 1:-1] > _NEAR_LARGEST * value[:, None]))
    if members.size:
        found = _golden(curve, omega[places], omega[places + 2], members)
        heights = curve(found[:, None], members)[:, 0]
        order = np.argsort(heights, kind="stable")
        members, heights, found = members[order], heights[order], found[order]
        highest, at = np.full(len(values), -np.inf), np.zeros(len(values))
        highest[members], at[members] = heights, found
        value, where = np.where(highest > value, highest, value), np.where(highest > value, at, where)
    return value, where


def _turns(curve: Curve, omega: Floats, values: Floats, sign: Floats) -> tuple[Array, Array, Floats]:
    """Return members, places and the frequencies at which curves come nearest to 0 without a change of sign there."""
    distance = np.abs(values)
    same = (sign[:, 1:-1] == sign[:, :-2]) & (sign[:, 1:-1] == sign[:, 2:]) & (sign[:, 1:-1] != 0.0)
    members, places = np.nonzero(same & _peaks(-distance) & (distance[:, 1:-1] < _TOUCHING))
    side = sign[members, places + 1]
    if not members.size:
        return members, places + 1, np.zeros(0)

    def approach(at: Floats, rows: Array) -> Floats:
        return -side[rows, None] * curve(at, members[rows])

    turn = _golden(approach, omega[places], omega[places + 2], np.arange(members.size))
    return members, places + 1, turn


def _peaks(values: Floats) -> Booleans:
    """Return where inner values are no less than both neighbours, (n, k-2)."""
    found: Booleans = (values[:, 1:-1] >= values[:, :-2]) & (values[:, 1:-1] > values[:, 2:])
    return found


def _golden(curve: Curve, lower: Floats, upper: Floats, members: Array) -> Floats:
    """Return where curves are largest between neighbours of a peak, by the golden section in log ω, (n,)."""
    a, b = np.log(lower), np.log(upper)
    c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
    at_c, at_d = (curve(np.exp(x)[:, None], members)[:, 0] for x in (c, d))
    for _ in range(_SECTIONS):
        left = at_c > at_d
        a, b = np.where(left, a, c), np.where(left, d, b)
        new = np.where(left, b - _GOLDEN * (b - a), a + _GOLDEN * (b - a))
        value = curve(np.exp(new)[:, None], members)[:, 0]
        c, d = np.where(left, new, d), np.where(left, c, new)
        at_c, at_d = np.where(left, value, at_d), np.where(left, at_c, value)
    return np.exp(0.5 * (a + b))
