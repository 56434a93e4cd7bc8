"""Steps of BDF2 for a plant in second-order form under a law with memory, one member at a time."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types

from fracctl.arrays import Array, Floats
from fracctl.compiling import ACCELERATION, BARE, DEMAND, helper, pointer_with, within
from fracctl.solvers.implicit_memory.equations import (
    CONTROL,
    D_KNOWN,
    D_SHARE,
    ERROR_RATE,
    LOWER,
    Q_KNOWN,
    Q_WANTED,
    RESIDUAL,
    START,
    UPPER,
    V_KNOWN,
    V_WANTED,
    WANTED,
    D,
    Given,
    Q,
    Room,
    bracketed,
    newton,
)

NEWTON, BRACKETED, UNRESOLVED = 0, 1, 2
"""How the equations of a step were solved: by Newton's method, by bracketing each row in turn, or not."""
_SMALL = 1e-3
"""Below it, exponentials are replaced by their series."""


class Path(NamedTuple):
    """What a march fills; the first rows of `states` and `auxiliary`, and the modes, hold the start."""

    states: Floats
    """[q, q'], (S + 1, 2m)."""
    memory: Floats
    """D^ν Δq, (S + 1, m)."""
    demands: Floats
    """(S + 1, m)."""
    auxiliary: Floats
    """z, (S + 1, p)."""
    modes: Floats
    """φ, (m, J), at the last time."""
    how: Array
    """How the equations of each step were solved, (S,)."""
    iterations: Array
    """Newton's iterations, (S,)."""


_ROW, _ROWS = types.f8[::1], types.f8[:, ::1]
_GIVEN = types.NamedTuple((_ROW, _ROW, _ROW, _ROWS, _ROWS, _ROW, _ROW, _ROWS, _ROWS), Given)  # type: ignore[no-untyped-call]
_PATH = types.NamedTuple((*[_ROWS] * 5, types.i1[::1], types.i4[::1]), Path)  # type: ignore[no-untyped-call]
_ROOM = types.NamedTuple((_ROWS, _ROWS, *[_ROW] * 5, _ROWS, *[_ROW] * 3), Room)  # type: ignore[no-untyped-call]
_MARCH = types.i8(types.FunctionType(ACCELERATION), types.FunctionType(DEMAND), _GIVEN, _PATH, _ROOM)


@within
def _filters(rates: Floats, h: float, decay: Floats, early: Floats, late: Floats) -> None:
    """Fill what a mode keeps over a step, and what it takes of a rate at its start and end that is linear between."""
    for j in range(len(rates)):
        s, z = rates[j], rates[j] * h
        decay[j] = math.exp(-z)
        if z < _SMALL:
            early[j] = h * (0.5 - z / 3.0 + z * z / 8.0)
            late[j] = h * (0.5 - z / 6.0 + z * z / 24.0)
        else:
            mean = -math.expm1(-z) / z
            early[j] = (mean - decay[j]) / s
            late[j] = (1.0 - mean) / s


@helper
def _remembered(weights: Floats, decay: Floats, modes: Floats) -> float:
    """Return what the modes of one component will give at the end of a step."""
    total = 0.0
    for j in range(len(decay)):
        total += weights[j] * decay[j] * modes[j]
    return total


@helper
def _lead(modes: Floats, decay: Floats, early: Floats, late: Floats, first: float, last: float) -> None:
    """Lead the modes of one component over a step with the rates at its start and end."""
    for j in range(len(decay)):
        modes[j] = decay[j] * modes[j] + early[j] * first + late[j] * last


@within
def _known_of_the_end(n: int, ratio: float, given: Given, path: Path, room: Room) -> None:
    """Fill `known`, but for the limits and D's share, for the step from n to n + 1."""
    states, known, orders = path.states, room.known, given.orders
    m, earlier = len(orders), max(n - 1, 0)
    one, two = _before(ratio)
    for i in range(m):
        known[Q_KNOWN, i] = one * states[n, i] - two * states[earlier, i]
        known[V_KNOWN, i] = one * states[n, m + i] - two * states[earlier, m + i]
        known[Q_WANTED, i] = given.reference[n + 1, i]
        known[V_WANTED, i] = given.reference_rate[n + 1, i]
        past = _remembered(given.weights[i], room.decay, path.modes[i])
        rate = states[n, m + i] - given.reference_rate[n, i]
        known[D_KNOWN, i] = past + known[D_SHARE, i] * (1.0 - orders[i]) * rate


@within
def _shares(h: float, orders: Floats, known: Floats) -> None:
    """Fill what the rate at the end of a step has of D, and its start 1 - ν times that."""
    for i in range(len(orders)):
        known[D_SHARE, i] = h ** (1.0 - orders[i]) / math.gamma(3.0 - orders[i])


@within
def _known_of_auxiliary(n: int, ratio: float, auxiliary: Floats, base: Floats) -> None:
    """Fill what the auxiliary states at the end of step n are without their rates there."""
    one, two = _before(ratio)
    for k in range(len(base)):
        base[k] = one * auxiliary[n, k] - two * auxiliary[max(n - 1, 0), k]


@within
def _predict(n: int, h: float, times: Floats, states: Floats, room: Room) -> None:
    """Continue the rates of the last three times, or keep the last ones."""
    v, m = room.v, len(room.v)
    for i in range(m):
        v[i] = states[n, m + i]
        if n > 2:
            slope = (v[i] - states[n - 1, m + i]) / (times[n] - times[n - 1])
            earlier = (states[n - 1, m + i] - states[n - 2, m + i]) / (times[n - 1] - times[n - 2])
            bend = (slope - earlier) / (times[n] - times[n - 2])
            v[i] += h * (slope + (times[n + 1] - times[n - 1]) * bend)
        room.found[START, i] = v[i]


@within
def _before(ratio: float) -> tuple[float, float]:
    """Return what the last two values add to one, and take from it, in a step `ratio` times as long as the last."""
    lead = (1.0 + 2.0 * ratio) / (1.0 + ratio)
    return (1.0 + ratio) / lead, ratio * ratio / (1.0 + ratio) / lead


@within
def _limited(found: Floats, known: Floats) -> int:
    """Return which controls are at which limit, as one number."""
    total = 0
    for i in range(found.shape[1]):
        total = 3 * total + (found[CONTROL, i] <= known[LOWER, i]) + 2 * (found[CONTROL, i] >= known[UPPER, i])
    return total


@within
def _solved(acceleration: Any, demand: Any, n: int, t: float, c: float, given: Given, path: Path, room: Room) -> None:
    """Solve for the end t of step n, and tell how."""
    count = newton(acceleration, demand, t, c, given, room)
    path.how[n], path.iterations[n] = NEWTON, abs(count)
    if count < 0:
        m = len(room.v)
        for i in range(m):
            room.v[i] = path.states[n, m + i]
        path.how[n] = BRACKETED if bracketed(acceleration, demand, t, c, given, room) else UNRESOLVED


@within
def _taken(n: int, given: Given, path: Path, room: Room) -> bool:
    """Store the end of step n and lead the modes there; return whether states and residuals are numbers."""
    v, found, states = room.v, room.found, path.states
    m, finite = len(v), True
    for i in range(m):
        states[n + 1, i], states[n + 1, m + i] = found[Q, i], v[i]
        path.memory[n + 1, i], path.demands[n + 1, i] = found[D, i], found[WANTED, i]
        finite = finite and math.isfinite(found[Q, i]) and math.isfinite(v[i]) and math.isfinite(found[RESIDUAL, i])
        before = states[n, m + i] - given.reference_rate[n, i]
        _lead(path.modes[i], room.decay, room.early, room.late, before, found[ERROR_RATE, i])
    for k in range(len(room.z)):
        path.auxiliary[n + 1, k] = room.z[k]
        room.peaks[k] = max(room.peaks[k], abs(room.z[k]))
    return finite


def room_for(m: int, p: int, modes: int) -> Room:
    """Return the arrays that `march` works in."""
    z, base, peaks = np.zeros((3, p))
    decay, early, late = np.zeros((3, modes))
    matrix = np.zeros((m, 2 * m))
    return Room(
        np.zeros((8, m)), np.zeros((10, m)), z, base, peaks, np.zeros(m), np.zeros(1), matrix, decay, early, late
    )


@pointer_with(_MARCH, **BARE)
def march(acceleration: Any, demand: Any, given: Given, path: Path, room: Room) -> int:
    """Make all steps of one member with the acceleration of its plant and the demand of its law.

    Returns:
        The number of steps taken before a state or an acceleration was no number.
    """
    times, known, found, rate = given.times, room.known, room.found, room.rate
    m = len(given.orders)
    rate[0], room.matrix[0, m] = 1.0, math.nan
    for i in range(m):
        known[LOWER, i], known[UPPER, i] = given.limits[0, i], given.limits[1, i]
    for k in range(len(room.z)):
        room.peaks[k] = abs(path.auxiliary[0, k])
    h, limited = 0.0, -1
    for n in range(len(times) - 1):
        ratio, h = (times[n + 1] - times[n]) / h if n else 0.0, times[n + 1] - times[n]
        if abs(ratio - 1.0) > 1e-12:
            rate[0] = 1.0
            _filters(given.rates, h, room.decay, room.early, room.late)
            _shares(h, given.orders, known)
        at_limits = _limited(found, known)
        if at_limits != limited:
            ratio, rate[0] = 0.0, 1.0
        limited = at_limits
        _known_of_the_end(n, ratio, given, path, room)
        _known_of_auxiliary(n, ratio, path.auxiliary, room.base)
        _predict(n, h, times, path.states, room)
        _solved(acceleration, demand, n, times[n + 1], h * (1.0 + ratio) / (1.0 + 2.0 * ratio), given, path, room)
        if not _taken(n, given, path, room):
            return n
    return len(times) - 1
