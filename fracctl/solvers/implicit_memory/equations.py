"""The equations of an implicit step: the rates at its end, by Newton's method or by bracketing."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from fracctl.arrays import Floats
from fracctl.compiling import called, within

_MOST_ITERATIONS, _MOST_SWEEPS, _MOST_HALVINGS = 12, 60, 200
_WIDEST, _ROUGH = 1e12, 1e-3
_CLOSE = 1e-10
"""Change of the rates, relative to 1 + |rate|, at which an iteration ends."""
_NEAR = 1e-9
"""The same for a first iteration that is known to be the last: what is stored beside the rates is that before it."""
_FAST, _LEAST_RATE = 0.1, 1e-3
_STEP_OF_DIFFERENCES = 1e-8
Q_KNOWN, V_KNOWN, D_KNOWN, D_SHARE, Q_WANTED, V_WANTED, LOWER, UPPER = range(8)
"""Rows of what a step knows of its end: q = Q + c v, v' = (v - V)/c, D = D_K + share Δv, q_d, q_d', control limits."""
Q, ERROR, ERROR_RATE, D, WANTED, CONTROL, RATE, RESIDUAL, START, KEPT = range(10)
"""Rows of what follows from the rates v at the end of a step."""


class Given(NamedTuple):
    """What a march is given: S steps of a member with m coordinates, J modes of the memory."""

    times: Floats
    """Ends of the steps, (S + 1,)."""
    plant: Floats
    """The plant's numbers."""
    law: Floats
    """Those of the law."""
    reference: Floats
    """q_d at the times, (S + 1, m)."""
    reference_rate: Floats
    """q_d', (S + 1, m)."""
    orders: Floats
    """ν, (m,)."""
    rates: Floats
    """Of the sum of exponentials, (J,)."""
    weights: Floats
    """Its weights, (m, J)."""
    limits: Floats
    """Of the controls, lower and upper, (2, m)."""


class Room(NamedTuple):
    """The arrays that a march works in: without any of its own it need not count who refers to them."""

    known: Floats
    """What a step knows of its end, (8, m)."""
    found: Floats
    """What follows from the rates there, (10, m)."""
    z: Floats
    """The auxiliary states, (p,)."""
    base: Floats
    """What they are without their rates at the end, (p,)."""
    peaks: Floats
    """Their largest sizes so far, (p,)."""
    v: Floats
    """The rates at the end of the step, (m,)."""
    rate: Floats
    """What Newton's iterations of earlier steps left of each other, (1,)."""
    matrix: Floats
    """Derivatives of the residual, and beside them their inverse, (m, 2m)."""
    decay: Floats
    """What a mode keeps over a step, (J,)."""
    early: Floats
    """What it takes of the rate at the step's start, (J,)."""
    late: Floats
    """And at its end, (J,)."""


@within
def _respond(acceleration: Any, demand: Any, t: float, c: float, given: Given, room: Room) -> None:
    """Fill `found` and `z` from the rates v at the end of a step."""
    known, found, v = room.known, room.found, room.v
    for i in range(len(v)):
        found[Q, i] = known[Q_KNOWN, i] + c * v[i]
        found[ERROR, i] = found[Q, i] - known[Q_WANTED, i]
        found[ERROR_RATE, i] = v[i] - known[V_WANTED, i]
        found[D, i] = known[D_KNOWN, i] + known[D_SHARE, i] * found[ERROR_RATE, i]
    q, error, error_rate, d, wanted = found[Q], found[ERROR], found[ERROR_RATE], found[D], found[WANTED]
    demand(t, q, v, error, error_rate, d, c, room.base, room.peaks, given.law, room.z, wanted)
    for i in range(len(v)):
        found[CONTROL, i] = min(max(found[WANTED, i], known[LOWER, i]), known[UPPER, i])
    acceleration(t, found[Q], v, found[CONTROL], given.plant, found[RATE])
    for i in range(len(v)):
        found[RESIDUAL, i] = v[i] - known[V_KNOWN, i] - c * found[RATE, i]


@called
def respond(acceleration: Any, demand: Any, t: float, c: float, given: Given, room: Room) -> None:
    """Fill `found` and `z` from the rates v at the end of a step; not copied into its callers."""
    _respond(acceleration, demand, t, c, given, room)


@within
def newton(acceleration: Any, demand: Any, t: float, c: float, given: Given, room: Room) -> int:
    """Solve for the rates v; return the iterations, or their negative number if they do not end.

    Newton's method with the derivatives of an earlier step, whose inverse is in the last columns of `matrix`, and with
    new ones, by differences, where an iteration does not take nine tenths off the last one. `rate` tells when a first
    iteration can be known to be the last.
    """
    rate, last = room.rate, math.inf
    for iteration in range(_MOST_ITERATIONS):
        _respond(acceleration, demand, t, c, given, room)
        size = _moved(room.v, room.found, room.matrix)
        if iteration:
            rate[0] = max(size / last, _LEAST_RATE) if last > 0.0 else _LEAST_RATE
        if size <= _NEAR and size * rate[0] <= _CLOSE and rate[0] <= _FAST:
            return iteration + 1
        if not size <= _FAST * last:
            rate[0] = 1.0
            return _with_new_derivatives(acceleration, demand, t, c, given, room, iteration + 1)
        last = size
    rate[0] = 1.0
    return -_MOST_ITERATIONS


@called
def _with_new_derivatives(
    acceleration: Any, demand: Any, t: float, c: float, given: Given, room: Room, before: int
) -> int:
    """Solve for the rates v with derivatives of each iteration; count those before, too."""
    v, found, matrix = room.v, room.found, room.matrix
    m = len(v)
    for i in range(m):
        v[i] = found[START, i]
    for iteration in range(_MOST_ITERATIONS):
        respond(acceleration, demand, t, c, given, room)
        for i in range(m):
            found[KEPT, i] = found[RESIDUAL, i]
        for j in range(m):
            kept = v[j]
            v[j] = kept + _STEP_OF_DIFFERENCES * (1.0 + abs(kept))
            respond(acceleration, demand, t, c, given, room)
            for i in range(m):
                matrix[i, j] = (found[RESIDUAL, i] - found[KEPT, i]) / (v[j] - kept)
                matrix[i, m + j] = 1.0 if i == j else 0.0
            v[j] = kept
        for i in range(m):
            found[RESIDUAL, i] = found[KEPT, i]
        if not _inverted(matrix):
            return -before - iteration - 1
        if _moved(v, found, matrix) <= _CLOSE:
            respond(acceleration, demand, t, c, given, room)
            return before + iteration + 1
    return -before - _MOST_ITERATIONS


@called
def _moved(v: Floats, found: Floats, matrix: Floats) -> float:
    """Take the inverse times the residual off v; return the largest change relative to 1 + |v|."""
    m, largest = len(v), 0.0
    for i in range(m):
        change = 0.0
        for j in range(m):
            change += matrix[i, m + j] * found[RESIDUAL, j]
        v[i] -= change
        if not abs(change) <= largest * (1.0 + abs(v[i])):
            largest = abs(change) / (1.0 + abs(v[i]))
    return largest


@called
def _inverted(matrix: Floats) -> bool:
    """Lead the first columns of a matrix (m, 2m) to those of the identity; False if they are singular."""
    m = len(matrix)
    for k in range(m):
        pivot = k
        for i in range(k + 1, m):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if not abs(matrix[pivot, k]) > 0.0 or not math.isfinite(matrix[pivot, k]):
            matrix[0, m] = math.nan
            return False
        for j in range(2 * m):
            matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        scale = 1.0 / matrix[k, k]
        for j in range(2 * m):
            matrix[k, j] *= scale
        for i in range(m):
            if i != k:
                factor = matrix[i, k]
                for j in range(2 * m):
                    matrix[i, j] -= factor * matrix[k, j]
    return True


@called
def _residual_at(
    acceleration: Any, demand: Any, t: float, c: float, given: Given, room: Room, i: int, value: float
) -> float:
    """Return row i of the residual where its own rate has another value."""
    room.v[i] = value
    respond(acceleration, demand, t, c, given, room)
    residual: float = room.found[RESIDUAL, i]
    return residual


@called
def bracketed(acceleration: Any, demand: Any, t: float, c: float, given: Given, room: Room) -> bool:
    """Solve row after row by bisection, each grows with its own rate, until Newton's method converges or they stay."""
    v, found = room.v, room.found
    precision = _ROUGH
    for _ in range(_MOST_SWEEPS):
        largest = 0.0
        for i in range(len(v)):
            before = v[i]
            if not _row_solved(acceleration, demand, t, c, given, room, i, precision):
                return False
            largest = max(largest, abs(v[i] - before) / (1.0 + abs(v[i])))
        for i in range(len(v)):
            found[START, i] = v[i]
        if _with_new_derivatives(acceleration, demand, t, c, given, room, 0) > 0:
            return True
        for i in range(len(v)):
            v[i] = found[START, i]
        precision = max(_CLOSE, _ROUGH * precision)
        if largest <= 10.0 * _CLOSE:
            respond(acceleration, demand, t, c, given, room)
            return True
    return False


@called
def _row_solved(
    acceleration: Any, demand: Any, t: float, c: float, given: Given, room: Room, i: int, precision: float
) -> bool:
    """Solve row i for its own rate, to a precision relative to 1 + |rate|; return whether its residual changes sign."""
    v = room.v
    low = high = v[i]
    width = 1e-6 * (1.0 + abs(v[i]))
    below = above = _residual_at(acceleration, demand, t, c, given, room, i, low)
    while below > 0.0 and width < _WIDEST:
        high, above = low, below
        low -= width
        width *= 4.0
        below = _residual_at(acceleration, demand, t, c, given, room, i, low)
    while above < 0.0 and width < _WIDEST:
        low, below = high, above
        high += width
        width *= 4.0
        above = _residual_at(acceleration, demand, t, c, given, room, i, high)
    if not below <= 0.0 <= above:
        return False
    for _ in range(_MOST_HALVINGS):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high or high - low <= precision * (1.0 + abs(high)):
            break
        if _residual_at(acceleration, demand, t, c, given, room, i, middle) < 0.0:
            low = middle
        else:
            high = middle
    v[i] = high
    return True
