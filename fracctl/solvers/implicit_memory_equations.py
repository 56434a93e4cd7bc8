"""The equations of an implicit step: the rates at its end, by Newton's method or by bracketing."""

from __future__ import annotations

import math
from typing import Any

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


@within
def _respond(
    acceleration: Any,
    demand: Any,
    t: float,
    c: float,
    v: Floats,
    known: Floats,
    base: Floats,
    peaks: Floats,
    plant: Floats,
    law: Floats,
    found: Floats,
    z: Floats,
) -> None:
    """Fill `found` and `z` from the rates v at the end of a step."""
    for i in range(len(v)):
        found[Q, i] = known[Q_KNOWN, i] + c * v[i]
        found[ERROR, i] = found[Q, i] - known[Q_WANTED, i]
        found[ERROR_RATE, i] = v[i] - known[V_WANTED, i]
        found[D, i] = known[D_KNOWN, i] + known[D_SHARE, i] * found[ERROR_RATE, i]
    demand(t, found[Q], v, found[ERROR], found[ERROR_RATE], found[D], c, base, peaks, law, z, found[WANTED])
    for i in range(len(v)):
        found[CONTROL, i] = min(max(found[WANTED, i], known[LOWER, i]), known[UPPER, i])
    acceleration(t, found[Q], v, found[CONTROL], plant, found[RATE])
    for i in range(len(v)):
        found[RESIDUAL, i] = v[i] - known[V_KNOWN, i] - c * found[RATE, i]


@called
def respond(
    acceleration: Any,
    demand: Any,
    t: float,
    c: float,
    v: Floats,
    known: Floats,
    base: Floats,
    peaks: Floats,
    plant: Floats,
    law: Floats,
    found: Floats,
    z: Floats,
) -> None:
    """Fill `found` and `z` from the rates v at the end of a step; not copied into its callers."""
    _respond(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z)


@within
def newton(
    acceleration: Any,
    demand: Any,
    t: float,
    c: float,
    v: Floats,
    known: Floats,
    base: Floats,
    peaks: Floats,
    plant: Floats,
    law: Floats,
    found: Floats,
    z: Floats,
    matrix: Floats,
    rate: Floats,
) -> int:
    """Solve for the rates v; return the iterations, or their negative number if they do not end.

    Newton's method with the derivatives of an earlier step, whose inverse is in the last columns of `matrix` (m, 2m),
    and with new ones, by differences, where an iteration does not take nine tenths off the last one. `rate` (1,) holds
    what the iterations of earlier steps left of each other, by which a first one can be known to be the last.
    """
    last = math.inf
    for iteration in range(_MOST_ITERATIONS):
        _respond(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z)
        size = _moved(v, found, matrix)
        if iteration:
            rate[0] = max(size / last, _LEAST_RATE) if last > 0.0 else _LEAST_RATE
        if size <= _NEAR and size * rate[0] <= _CLOSE and rate[0] <= _FAST:
            return iteration + 1
        if not size <= _FAST * last:
            rate[0] = 1.0
            return _with_new_derivatives(
                acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z, matrix, iteration + 1
            )
        last = size
    rate[0] = 1.0
    return -_MOST_ITERATIONS


@called
def _with_new_derivatives(
    acceleration: Any,
    demand: Any,
    t: float,
    c: float,
    v: Floats,
    known: Floats,
    base: Floats,
    peaks: Floats,
    plant: Floats,
    law: Floats,
    found: Floats,
    z: Floats,
    matrix: Floats,
    before: int,
) -> int:
    """Solve for the rates v with derivatives of each iteration; count those before, too."""
    m = len(v)
    for i in range(m):
        v[i] = found[START, i]
    for iteration in range(_MOST_ITERATIONS):
        respond(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z)
        for i in range(m):
            found[KEPT, i] = found[RESIDUAL, i]
        for j in range(m):
            kept = v[j]
            v[j] = kept + _STEP_OF_DIFFERENCES * (1.0 + abs(kept))
            respond(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z)
            for i in range(m):
                matrix[i, j] = (found[RESIDUAL, i] - found[KEPT, i]) / (v[j] - kept)
                matrix[i, m + j] = 1.0 if i == j else 0.0
            v[j] = kept
        for i in range(m):
            found[RESIDUAL, i] = found[KEPT, i]
        if not _inverted(matrix):
            return -before - iteration - 1
        if _moved(v, found, matrix) <= _CLOSE:
            respond(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z)
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
    acceleration: Any,
    demand: Any,
    t: float,
    c: float,
    v: Floats,
    i: int,
    value: float,
    known: Floats,
    base: Floats,
    peaks: Floats,
    plant: Floats,
    law: Floats,
    found: Floats,
    z: Floats,
) -> float:
    """Return row i of the residual where its own rate has another value."""
    v[i] = value
    respond(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z)
    residual: float = found[RESIDUAL, i]
    return residual


@called
def bracketed(
    acceleration: Any,
    demand: Any,
    t: float,
    c: float,
    v: Floats,
    known: Floats,
    base: Floats,
    peaks: Floats,
    plant: Floats,
    law: Floats,
    found: Floats,
    z: Floats,
    matrix: Floats,
) -> bool:
    """Solve row after row by bisection, each grows with its own rate, until Newton's method converges or they stay."""
    precision = _ROUGH
    for _ in range(_MOST_SWEEPS):
        largest = 0.0
        for i in range(len(v)):
            before = v[i]
            if not _row_solved(acceleration, demand, t, c, v, i, precision, known, base, peaks, plant, law, found, z):
                return False
            largest = max(largest, abs(v[i] - before) / (1.0 + abs(v[i])))
        for i in range(len(v)):
            found[START, i] = v[i]
        if (
            _with_new_derivatives(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z, matrix, 0)
            > 0
        ):
            return True
        for i in range(len(v)):
            v[i] = found[START, i]
        precision = max(_CLOSE, _ROUGH * precision)
        if largest <= 10.0 * _CLOSE:
            respond(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z)
            return True
    return False


@called
def _row_solved(
    acceleration: Any,
    demand: Any,
    t: float,
    c: float,
    v: Floats,
    i: int,
    precision: float,
    known: Floats,
    base: Floats,
    peaks: Floats,
    plant: Floats,
    law: Floats,
    found: Floats,
    z: Floats,
) -> bool:
    """Solve row i for its own rate, to a precision relative to 1 + |rate|; return whether its residual changes sign."""
    low = high = v[i]
    width = 1e-6 * (1.0 + abs(v[i]))
    below = above = _residual_at(acceleration, demand, t, c, v, i, low, known, base, peaks, plant, law, found, z)
    while below > 0.0 and width < _WIDEST:
        high, above = low, below
        low -= width
        width *= 4.0
        below = _residual_at(acceleration, demand, t, c, v, i, low, known, base, peaks, plant, law, found, z)
    while above < 0.0 and width < _WIDEST:
        low, below = high, above
        high += width
        width *= 4.0
        above = _residual_at(acceleration, demand, t, c, v, i, high, known, base, peaks, plant, law, found, z)
    if not below <= 0.0 <= above:
        return False
    for _ in range(_MOST_HALVINGS):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high or high - low <= precision * (1.0 + abs(high)):
            break
        if _residual_at(acceleration, demand, t, c, v, i, middle, known, base, peaks, plant, law, found, z) < 0.0:
            low = middle
        else:
            high = middle
    v[i] = high
    return True
