"""Steps of BDF2 for a plant in second-order form under a law with memory, one member at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from fracctl.arrays import Array, Floats
from fracctl.compiling import ACCELERATION, BARE, DEMAND, helper, pointer_with, within
from fracctl.solvers.implicit_memory_equations import (
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
    Q,
    bracketed,
    newton,
)

NEWTON, BRACKETED, UNRESOLVED = 0, 1, 2
"""How the equations of a step were solved: by Newton's method, by bracketing each row in turn, or not."""
_SMALL = 1e-3
"""Below it, exponentials are replaced by their series."""
_ROW, _ROWS = types.f8[::1], types.f8[:, ::1]
_MARCH = types.i8(
    types.FunctionType(ACCELERATION),
    types.FunctionType(DEMAND),
    *(_ROW, _ROW, _ROW, _ROWS, _ROWS, _ROW, _ROW),
    *[_ROWS] * 7,
    types.i1[::1],
    types.i4[::1],
    types.Tuple((_ROWS, _ROWS, *[_ROW] * 5, _ROWS, *[_ROW] * 3)),  # type: ignore[no-untyped-call]
)


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
def _known_of_the_end(
    n: int,
    ratio: float,
    states: Floats,
    reference: Floats,
    reference_rate: Floats,
    orders: Floats,
    weights: Floats,
    decay: Floats,
    modes: Floats,
    known: Floats,
) -> None:
    """Fill `known`, but for the limits and D's share, for the step from n to n + 1."""
    m, earlier = len(orders), max(n - 1, 0)
    one, two = _before(ratio)
    for i in range(m):
        known[Q_KNOWN, i] = one * states[n, i] - two * states[earlier, i]
        known[V_KNOWN, i] = one * states[n, m + i] - two * states[earlier, m + i]
        known[Q_WANTED, i] = reference[n + 1, i]
        known[V_WANTED, i] = reference_rate[n + 1, i]
        past = _remembered(weights[i], decay, modes[i])
        known[D_KNOWN, i] = past + known[D_SHARE, i] * (1.0 - orders[i]) * (states[n, m + i] - reference_rate[n, i])


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
def _predict(n: int, h: float, times: Floats, states: Floats, v: Floats, found: Floats) -> None:
    """Continue the rates of the last three times, or keep the last ones; in `v` and `found`."""
    m = len(v)
    for i in range(m):
        v[i] = states[n, m + i]
        if n > 2:
            slope = (v[i] - states[n - 1, m + i]) / (times[n] - times[n - 1])
            earlier = (states[n - 1, m + i] - states[n - 2, m + i]) / (times[n - 1] - times[n - 2])
            bend = (slope - earlier) / (times[n] - times[n - 2])
            v[i] += h * (slope + (times[n + 1] - times[n - 1]) * bend)
        found[START, i] = v[i]


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
def _taken(
    n: int,
    v: Floats,
    found: Floats,
    z: Floats,
    reference_rate: Floats,
    decay: Floats,
    early: Floats,
    late: Floats,
    modes: Floats,
    states: Floats,
    memory: Floats,
    demands: Floats,
    auxiliary: Floats,
    peaks: Floats,
) -> bool:
    """Store the end of step n and lead the modes there; return whether states and residuals are numbers."""
    m, finite = len(v), True
    for i in range(m):
        states[n + 1, i], states[n + 1, m + i] = found[Q, i], v[i]
        memory[n + 1, i], demands[n + 1, i] = found[D, i], found[WANTED, i]
        finite = finite and math.isfinite(found[Q, i]) and math.isfinite(v[i]) and math.isfinite(found[RESIDUAL, i])
        before = states[n, m + i] - reference_rate[n, i]
        _lead(modes[i], decay, early, late, before, found[ERROR_RATE, i])
    for k in range(len(z)):
        auxiliary[n + 1, k] = z[k]
        peaks[k] = max(peaks[k], abs(z[k]))
    return finite


def room_for(m: int, p: int, modes: int) -> tuple[Floats, ...]:
    """Return the arrays that `march` works in: without any of its own it need not count who refers to them."""
    vectors, filters = (np.zeros(p) for _ in range(3)), (np.zeros(modes) for _ in range(3))
    return np.zeros((8, m)), np.zeros((10, m)), *vectors, np.zeros(m), np.zeros(1), np.zeros((m, 2 * m)), *filters


@pointer_with(_MARCH, **BARE)
def march(
    acceleration: Any,
    demand: Any,
    times: Floats,
    plant: Floats,
    law: Floats,
    reference: Floats,
    reference_rate: Floats,
    orders: Floats,
    rates: Floats,
    weights: Floats,
    limits: Floats,
    modes: Floats,
    states: Floats,
    memory: Floats,
    demands: Floats,
    auxiliary: Floats,
    how: Array,
    iterations: Array,
    room: tuple[Floats, ...],
) -> int:
    """Make all steps of one member.

    Args:
        acceleration: of the plant.
        demand: of the law.
        times: ends of the S steps, (S + 1,).
        plant: the plant's numbers.
        law: those of the law.
        reference: q_d at the times, (S + 1, m).
        reference_rate: q_d', (S + 1, m).
        orders: ν, (m,).
        rates: of the sum of exponentials, (J,).
        weights: its weights, (m, J).
        limits: of the controls, lower and upper, (2, m).
        modes: φ(0), (m, J); overwritten.
        states: to be filled, (S + 1, 2m); holds [q(0), q'(0)].
        memory: to be filled with D^ν Δq, (S + 1, m).
        demands: to be filled, (S + 1, m).
        auxiliary: to be filled, (S + 1, p); holds z(0).
        how: to be filled with how the equations of each step were solved, (S,).
        iterations: to be filled with Newton's iterations, (S,).
        room: arrays to work in, see `room_for`.

    Returns:
        The number of steps taken before a state or an acceleration was no number.
    """
    m = len(orders)
    known, found, z, base, peaks, v, rate, matrix, decay, early, late = room
    rate[0], matrix[0, m] = 1.0, math.nan
    for i in range(m):
        known[LOWER, i], known[UPPER, i] = limits[0, i], limits[1, i]
    for k in range(len(z)):
        peaks[k] = abs(auxiliary[0, k])
    h, limited = 0.0, -1
    for n in range(len(times) - 1):
        ratio, h = (times[n + 1] - times[n]) / h if n else 0.0, times[n + 1] - times[n]
        if abs(ratio - 1.0) > 1e-12:
            rate[0] = 1.0
            _filters(rates, h, decay, early, late)
            _shares(h, orders, known)
        at_limits = _limited(found, known)
        if at_limits != limited:
            ratio, rate[0] = 0.0, 1.0
        limited = at_limits
        _known_of_the_end(n, ratio, states, reference, reference_rate, orders, weights, decay, modes, known)
        _known_of_auxiliary(n, ratio, auxiliary, base)
        _predict(n, h, times, states, v, found)
        t, c = times[n + 1], h * (1.0 + ratio) / (1.0 + 2.0 * ratio)
        count = newton(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z, matrix, rate)
        how[n], iterations[n] = NEWTON, abs(count)
        if count < 0:
            for i in range(m):
                v[i] = states[n, m + i]
            solved = bracketed(acceleration, demand, t, c, v, known, base, peaks, plant, law, found, z, matrix)
            how[n] = BRACKETED if solved else UNRESOLVED
        if not _taken(
            n, v, found, z, reference_rate, decay, early, late, modes, states, memory, demands, auxiliary, peaks
        ):
            return n
    return len(times) - 1
