"""The phase of a determinant along the imaginary axis where steps are doubtful: they are divided until none is.

Few members need this, and some batches none, so that it is compiled apart from `fracctl.characteristic.phase`. It takes
determinants of any size.
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Booleans, Complexes, Floats
from fracctl.characteristic.determinants import determinant
from fracctl.characteristic.phase import LARGEST_CHANGE, crossing, factor_at, turned, zeros_from
from fracctl.compiling import compiled, helper

_SMALLEST_STEP = 1e-13
"""Relative length at which a step is given up: the phase turns on the axis itself."""
_ROUNDING = 1e-15
"""Of a determinant, relative to the product of its row sums."""


@compiled
def zeros_with_doubts(
    coefficients: Floats,
    orders: Floats,
    place: Array,
    degree: Floats,
    sums: Floats,
    line: Floats,
    rho: float,
    lasts: Array,
) -> tuple[Floats, Booleans]:
    """Count the zeros of a determinant with Re σ > 0.

    Args:
        coefficients: c, (b, K).
        orders: β, (1, K) or (b, K).
        place: row and column of each power, (K, 2).
        degree: of the determinant at infinity, (1,) or (b,).
        sums: row sums at the origin, (b, p).
        line: log r at the nodes on the imaginary axis, descending from beyond all zeros.
        rho: log ρ.
        lasts: last node that the path of each member needs, (b,).

    Returns:
        The counts (b,), and whether (b,) no zero lies on the axis, to rounding.
    """
    count, size, most = len(coefficients), sums.shape[1], len(line) + 1000
    zeros, resolved = np.zeros(count), np.zeros(count, np.bool_)
    parts, beyond = (2, 0) if size < 3 else (2 * size, 1)
    path, part, stack = np.empty((3, len(line))), np.empty((3, parts + 1 + 2 * beyond)), np.empty((6, most))
    matrix, unit = np.empty((size, size), np.complex128), np.empty((2, len(place)))
    for i in range(count):
        own, last = min(i, len(orders) - 1), lasts[i]
        for t in range(len(place)):
            unit[0, t], unit[1, t] = turned(orders[own, t])
        for n in range(last + 1):
            path[0, n] = line[n]
            _evaluate(coefficients, i, orders, own, place, unit, degree[own], rho, path, n, matrix)
        turns, depth = _counted(path, 0, last, last, stack, 0)
        clear = True
        while depth > 0 and clear:
            depth -= 1
            for k in range(3):
                part[k, beyond], part[k, beyond + parts] = stack[k, depth], stack[3 + k, depth]
            low, high = stack[0, depth], stack[3, depth]
            clear = abs(high - low) >= _SMALLEST_STEP and depth + parts < most
            for n in range(part.shape[1]):
                if clear and n != beyond and n != beyond + parts:
                    part[0, n] = low + (high - low) * ((n - beyond) / parts)
                    clear = _evaluate(coefficients, i, orders, own, place, unit, degree[own], rho, part, n, matrix)
            if clear:
                more, depth = _counted(part, beyond, beyond + parts, part.shape[1] - 1, stack, depth)
                turns += more
        zeros[i] = zeros_from(turns, path[1, last], path[2, last], degree[own], line[last] - rho)
        resolved[i] = clear
    return zeros, resolved


@helper
def _evaluate(
    c: Floats,
    i: int,
    orders: Floats,
    own: int,
    place: Array,
    unit: Floats,
    degree: float,
    rho: float,
    path: Floats,
    n: int,
    matrix: Complexes,
) -> bool:
    """Fill in what is followed at node n of a path of log r, real and imaginary parts; whether it is above rounding."""
    size = len(matrix)
    for j in range(size):
        for k in range(size):
            matrix[j, k] = 0.0
    largest, total, row = 1.0, 0.0, 0
    for t in range(len(place)):
        power = c[i, t] * np.exp(orders[own, t] * path[0, n])
        matrix[place[t, 0], place[t, 1]] += complex(power * unit[0, t], power * unit[1, t])
        if place[t, 0] != row:
            largest, total, row = largest * total, 0.0, place[t, 0]
        total += abs(power)
    value = determinant(matrix)
    x, y = factor_at(path[0, n] - rho, degree)
    path[1, n], path[2, n] = value.real * x - value.imag * y, value.real * y + value.imag * x
    return abs(value.real) + abs(value.imag) >= _ROUNDING * largest * total


@helper
def _counted(path: Floats, first: int, stop: int, steps: int, stack: Floats, depth: int) -> tuple[int, int]:
    """Count crossings in the steps from `first` to `stop` that are not doubtful and put the others on the stack.

    The path has `steps` in all; a column of the stack is both ends of a step. Also return its new depth.
    """
    turns = 0
    for n in range(first, stop):
        change = 0.0
        for m in range(max(n - 1, 0), min(n + 2, steps)):
            change = max(change, abs(path[1, m + 1] - path[1, m]) + abs(path[2, m + 1] - path[2, m]))
        x0, y0, x1, y1 = path[1, n], path[2, n], path[1, n + 1], path[2, n + 1]
        if change < LARGEST_CHANGE * (abs(x0) + abs(y0) + abs(x1) + abs(y1)):
            turns += crossing(x0, y0, x1, y1)
        else:
            for k in range(3):
                stack[k, depth], stack[3 + k, depth] = path[k, n], path[k, n + 1]
            depth += 1
    return turns, depth
