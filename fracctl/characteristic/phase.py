"""The phase of a determinant along the imaginary axis, member by member, compiled.

The path leads down the axis, σ = i r, in equal steps of log r: from where M̃ is near the identity to where det M(σ)
stays in a disc around det M(0) that 0 lies outside of. Where there is no such disc it goes on, with a small arc around
the branch point at its end. What is followed is det M / Π (σ + ρ)^ℓ, finite at the origin and 1 at infinity.

Steps next to which the function changes by its own size are halved until none does: two zeros close to each other and
to the path turn the phase by 2π within a step that they leave no other trace in than this rate of change.

No path is needed for one coordinate where Im M(i r) = Σ c r^β sin(β π/2) has one sign for all r.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fracctl.arrays import Array, Booleans, Complexes, Floats
from fracctl.characteristic.determinants import determinant, determinants
from fracctl.compiling import compiled

_LARGEST_CHANGE = 0.5
"""Change of a function over a step, relative to its size at both ends, beyond which the step is doubtful."""
_SMALLEST_STEP = 1e-13
"""Relative length at which a step is given up: the phase turns on the axis itself."""
_ROUNDING = 1e-15
"""Of a determinant, relative to the product of its row sums."""
_DISC = 0.9
"""Radius of the disc around det M(0), relative to |det M(0)|."""


@compiled
def zeros_to_the_right(
    coefficients: Floats,
    exponents: Floats,
    place: Array,
    highest: Floats,
    gone: int,
    vanishing: Floats,
    line: Floats,
    arc: Floats,
) -> tuple[Floats, Booleans, Booleans]:
    """Count the zeros of a determinant with Re σ > 0.

    Args:
        coefficients: c of the powers c σ^e in the entries of M̃, row by row, (b, K).
        exponents: e, (1, K) or (b, K).
        place: row and column of each power, (K, 2).
        highest: ℓ of each column, (p,).
        gone: how many coordinates, the last ones, hold no other of them.
        vanishing: size below which det M(0) is 0 to rounding, (b,).
        line: log r at the nodes on the imaginary axis, descending from beyond all zeros.
        arc: angles of the nodes after them, with the last r, in right angles, down to 0.

    Returns:
        The counts (b,); whether (b,) no zero lies on the axis, to rounding; and whether (b,) the line ends too early
        to see all zeros near the origin.
    """
    count, size, nodes = len(coefficients), len(highest), len(line) + len(arc)
    zeros, resolved, short = np.zeros(count), np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    path = np.empty((4, nodes))
    path[0], path[1] = np.append(line, np.full(len(arc), line[-1])), np.append(np.ones(len(line)), arc)
    table, reach = np.empty((2, len(place), nodes)), np.empty((len(line), len(place)))
    factor, degree, rho = np.empty((2, nodes)), highest.sum(), line[0] - np.log(4.0 * size)
    for n in range(nodes):
        factor[0, n], factor[1, n] = _factor(path[0, n] - rho, path[1, n], degree)
    parts, beyond = (2, 0) if size < 3 else (2 * size, 1)
    entries, work, part = np.empty((2, size * size, nodes)), np.empty((2, nodes)), np.empty((4, parts + 1 + 2 * beyond))
    matrix, sums, stack = np.empty((size, size), np.complex128), np.empty(size), np.empty((nodes + 64 * parts, 2, 4))
    lift, end = np.empty(len(place)), 0
    for i in range(count):
        c, e = coefficients[i], exponents[min(i, len(exponents) - 1)]
        if i == 0 or len(exponents) > 1:
            _tabulate(e, place, highest, path, table, reach, lift)
        static, integral = _at_origin(c, e, place, highest, matrix, sums)
        if not integral and abs(static) <= vanishing[i]:
            continue
        if size == 1 and not integral:
            zeros[i], resolved[i] = _by_sign(c, lift, static)
            if resolved[i]:
                continue
        end = _disc(c, reach, place, sums, 0.0 if integral else _DISC * abs(static), end)
        last = min(end + 1, len(line) - 1) if end < len(line) else nodes - 1
        _evaluate(c, table, place, gone, last + 1, factor, entries, path)
        if _is_smooth(path, last, work):
            turns, resolved[i] = _crossings(path, last), True
        else:
            turns, resolved[i] = _refined((c, e, place, rho, degree), path[:, : last + 1], part, beyond, stack, matrix)
        x, y = path[2, last], path[3, last]
        if end < len(line):
            phase = 2.0 * np.pi * turns + (np.arctan2(abs(y), x) if y >= 0.0 else np.arctan2(y, x))
            zeros[i] = np.rint((phase + degree * np.arctan(np.exp(line[last] - rho))) / np.pi)
        else:
            zeros[i], short[i] = 2.0 * turns + (x < 0.0) + (not integral and static * x < 0.0), not integral
    return zeros, resolved, short


@compiled
def _cis(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle in right angles, exact at whole ones."""
    whole = np.rint(angle)
    if angle == whole:
        quadrant = int(whole) % 4
        return (1.0 - quadrant if quadrant % 2 == 0 else 0.0), (2.0 - quadrant if quadrant % 2 == 1 else 0.0)
    return np.cos(0.5 * np.pi * angle), np.sin(0.5 * np.pi * angle)


@compiled
def _factor(log_r: float, angle: float, degree: float) -> tuple[float, float]:
    """(σ / (σ + 1))^degree, which leads from det M̃ to what is followed; σ in units of ρ."""
    x, y = _cis(angle)
    re, im = np.exp(log_r) * x + 1.0, np.exp(log_r) * y
    size = np.exp(degree * (log_r - 0.5 * np.log(re * re + im * im)))
    x, y = _cis(degree * (angle - np.arctan2(im, re) / (0.5 * np.pi)))
    return size * x, size * y


@compiled
def _tabulate(
    e: Floats, place: Array, highest: Floats, path: Floats, table: Floats, reach: Floats, lift: Floats
) -> None:
    """Fill in real and imaginary parts of σ^e, (2, K, nodes), |σ|^β on the line, (n, K), 0 at β = 0, sin(β π/2)."""
    log_r, angle = path[0], path[1]
    for t in range(len(e)):
        order = e[t] + highest[place[t, 1]]
        lift[t] = _cis(order)[1]
        x, y = _cis(e[t])
        for n in range(len(log_r)):
            if n < len(reach):
                reach[n, t] = 0.0 if order == 0.0 else np.exp(order * log_r[n])
            else:
                x, y = _cis(e[t] * angle[n])
            size = np.exp(e[t] * log_r[n])
            table[0, t, n], table[1, t, n] = size * x, size * y


@compiled
def _at_origin(
    c: Floats, e: Floats, place: Array, highest: Floats, matrix: Complexes, sums: Floats
) -> tuple[float, bool]:
    """Return det M(0), and whether there are negative orders instead; fill in the row sums of |M(0)|."""
    matrix[:] = 0.0
    integral = False
    for t in range(len(c)):
        order = e[t] + highest[place[t, 1]]
        if order == 0.0:
            matrix[place[t, 0], place[t, 1]] += c[t]
        integral |= order < 0.0 and c[t] != 0.0
    for j in range(len(highest)):
        sums[j] = 0.0
        for k in range(len(highest)):
            sums[j] += abs(matrix[j, k].real)
    return determinant(matrix).real, integral


@compiled
def _by_sign(c: Floats, lift: Floats, static: float) -> tuple[int, bool]:
    """Count the zeros of one coordinate if Im M has one sign on the upper imaginary axis, and say whether it has.

    From a phase of ℓ π/2 at infinity, M then goes to M(0) through the upper half plane alone, or the lower.
    """
    up, down = False, False
    for t in range(len(c)):
        up |= c[t] * lift[t] > 0.0
        down |= c[t] * lift[t] < 0.0
    return (1 if static < 0.0 else 2 if down else 0), up != down


@compiled
def _disc(c: Floats, reach: Floats, place: Array, sums: Floats, radius: float, guess: int) -> int:
    """Return the first node from which on det M stays within `radius` of det M(0); beyond the last if there is none."""
    end, limit = min(guess, len(reach) - 1), sums.prod() + radius
    while end < len(reach) and _bound(c, reach, place, sums, end) >= limit:
        end += 1
    if end <= guess:
        while end > 0 and _bound(c, reach, place, sums, end - 1) < limit:
            end -= 1
    return end


@compiled
def _bound(c: Floats, reach: Floats, place: Array, sums: Floats, n: int) -> float:
    """Π (a_i + e_i) ≥ |det (A + E) - det A| + Π a_i, with the row sums of |A| and |E|; A = M(0), A + E = M(σ)."""
    whole: float = 1.0
    total, row = sums[0], 0
    for t in range(len(c)):
        if place[t, 0] != row:
            row = place[t, 0]
            whole, total = whole * total, sums[row]
        total += abs(c[t]) * reach[n, t]
    whole *= total
    return whole


@compiled
def _evaluate(
    c: Floats, table: Floats, place: Array, gone: int, count: int, factor: Floats, entries: Floats, path: Floats
) -> None:
    """Fill in the function at the first nodes."""
    size = int(np.sqrt(entries.shape[1]))
    for where in range(entries.shape[1]):
        for n in range(count):
            entries[0, where, n] = 0.0
            entries[1, where, n] = 0.0
    for t in range(len(c)):
        where, coefficient = size * place[t, 0] + place[t, 1], c[t]
        for n in range(count):
            entries[0, where, n] += coefficient * table[0, t, n]
            entries[1, where, n] += coefficient * table[1, t, n]
    determinants(entries, count, size, gone, path)
    for n in range(count):
        x, y = path[2, n], path[3, n]
        path[2, n] = x * factor[0, n] - y * factor[1, n]
        path[3, n] = x * factor[1, n] + y * factor[0, n]


@compiled
def _is_smooth(path: Floats, steps: int, work: Floats) -> bool:
    """Whether no step is doubtful."""
    for n in range(steps + 1):
        work[0, n] = abs(path[2, n]) + abs(path[3, n])
    for n in range(steps):
        work[1, n] = _change(path, n)
    doubts = 0
    for n in range(steps):
        doubts += not work[1, n] < _LARGEST_CHANGE * (work[0, n] + work[0, n + 1])
    for n in range(steps - 1):
        doubts += not work[1, n] < _LARGEST_CHANGE * (work[0, n + 1] + work[0, n + 2])
        doubts += not work[1, n + 1] < _LARGEST_CHANGE * (work[0, n] + work[0, n + 1])
    return doubts == 0


@compiled
def _crossings(path: Floats, steps: int) -> int:
    """Crossings of the negative real axis along a path without doubtful steps."""
    turns = 0
    for n in range(steps):
        turns += _crossing(path[2, n], path[3, n], path[2, n + 1], path[3, n + 1])
    return turns


@compiled
def _refined(
    function: Any, path: Floats, part: Floats, beyond: int, stack: Floats, matrix: Complexes
) -> tuple[int, bool]:
    """Crossings of the negative real axis along a path, and whether each of its steps was resolved.

    A node is a column of log r, angle, real and imaginary part; a row of the stack holds both ends of a doubtful step.
    It is divided into the steps of `part`, less those beyond its ends.
    """
    turns, depth = _counted(path, 0, path.shape[1] - 1, stack, 0)
    last = part.shape[1] - 1 - beyond
    while depth:
        depth -= 1
        a, b = stack[depth, 0], stack[depth, 1]
        if np.hypot(b[0] - a[0], 0.5 * np.pi * (b[1] - a[1])) < _SMALLEST_STEP:
            return turns, False
        part[:, beyond], part[:, last] = a, b
        for n in range(part.shape[1]):
            if n not in (beyond, last):
                part[:2, n] = a[:2] + (b[:2] - a[:2]) * ((n - beyond) / (last - beyond))
                part[2, n], part[3, n], is_noise = _value(function, part[0, n], part[1, n], matrix)
                if is_noise:
                    return turns, False
        more, depth = _counted(part, beyond, last, stack, depth)
        turns += more
    return turns, True


@compiled
def _counted(path: Floats, first: int, last: int, stack: Floats, depth: int) -> tuple[int, int]:
    """Count crossings in the steps that are not doubtful and put the others on the stack; return its depth, too."""
    turns = 0
    for n in range(first, last):
        change = max(_change(path, max(n - 1, 0)), _change(path, n), _change(path, min(n + 1, path.shape[1] - 2)))
        x0, y0, x1, y1 = path[2, n], path[3, n], path[2, n + 1], path[3, n + 1]
        if change < _LARGEST_CHANGE * (abs(x0) + abs(y0) + abs(x1) + abs(y1)):
            turns += _crossing(x0, y0, x1, y1)
        else:
            stack[depth, 0], stack[depth, 1] = path[:, n], path[:, n + 1]
            depth += 1
    return turns, depth


@compiled
def _change(path: Floats, n: int) -> float:
    change: float = abs(path[2, n + 1] - path[2, n]) + abs(path[3, n + 1] - path[3, n])
    return change


@compiled
def _crossing(x0: float, y0: float, x1: float, y1: float) -> int:
    """1 for a step through the negative real axis counter-clockwise, -1 for one clockwise; less than a right angle."""
    if (y0 < 0.0) == (y1 < 0.0) or (x0 * y1 - x1 * y0) * (y1 - y0) >= 0.0:
        return 0
    return 1 if y1 < 0.0 else -1


@compiled
def _value(function: Any, log_r: float, angle: float, matrix: Complexes) -> tuple[float, float, bool]:
    """What is followed, at one point, and whether it does not stand out from the rounding of its terms."""
    c, e, place, rho, degree = function
    matrix[:] = 0.0
    largest, total, row = 1.0, 0.0, 0
    for t in range(len(c)):
        x, y = _cis(e[t] * angle)
        size = c[t] * np.exp(e[t] * log_r)
        matrix[place[t, 0], place[t, 1]] += complex(size * x, size * y)
        if place[t, 0] != row:
            largest, total, row = largest * total, 0.0, place[t, 0]
        total += abs(size)
    value = determinant(matrix)
    x, y = _factor(log_r - rho, angle, degree)
    is_noise = abs(value.real) + abs(value.imag) < _ROUNDING * largest * total
    return value.real * x - value.imag * y, value.real * y + value.imag * x, is_noise
