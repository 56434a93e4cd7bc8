"""The number of poles right of a line, by the argument principle.

det M̃ is followed along a path that closes in the upper right quarter: from a real point beyond all zeros along an
arc to the line Re σ = a, down the line, and by a small arc around the branch point back to the real axis. By the
symmetry of det M̃ about the real axis, the number of zeros to the right is the change of phase over π.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Booleans, Complexes, Floats
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.kernels import LARGEST_CHANGE, follow
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.fractional.terms import powers

_INNER = 1e-5
"""Radius of the arc around the branch point; zeros on the real axis inside it are found by the sign at 0."""
_RATIO = 1.2
_SMALLEST_STEP = 1e-13
"""Relative length at which an interval of the path is given up: the phase turns on the line itself."""


def unstable_zeros(matrix: CharacteristicMatrix, radius: Floats | None = None) -> tuple[Floats, Booleans]:
    """Count the zeros of det M̃ with Re σ > 0.

    Args:
        matrix: the characteristic matrix of a batch of b loops.
        radius: its `pole_radius`, if that is known already.

    Returns:
        The counts (b,), NaN where a zero lies on the imaginary axis to rounding, and whether (b,) the loop is
        marginal in that sense.
    """
    outer = 2.0 * float(np.max(pole_radius(matrix) if radius is None else radius))
    n_line = 2 + int(np.log(outer / _INNER) / np.log(_RATIO))
    line = 1j * np.geomspace(outer, _INNER, n_line)
    arc = _INNER * np.exp(1j * np.linspace(np.pi / 2, 0.0, 8))[1:]
    arc[-1] = _INNER
    path = np.concatenate([line, arc])
    turns, marginal = np.zeros(matrix.batch), np.zeros(matrix.batch, dtype=bool)
    for block in matrix.blocks():
        part_turns, resolved = _turns(matrix, block, path)
        turns += part_turns
        marginal |= ~resolved
    zeros, at_origin = _at_origin(matrix, turns)
    marginal |= at_origin
    return np.where(marginal, np.nan, zeros), marginal


def abscissa_bound(matrix: CharacteristicMatrix, resolution: float) -> Floats:
    """Return a (b,), a bound on the real parts of all poles that exceeds the largest by at most `resolution`.

    Meant for loops with a pole in the right half plane; bisection on the number of zeros right of Re σ = a.
    """
    upper = pole_radius(matrix)
    lower = np.zeros_like(upper)
    while np.max(upper - lower) > resolution:
        middle = 0.5 * (lower + upper)
        none = _none_right_of(matrix, middle, 2.0 * pole_radius(matrix))
        upper, lower = np.where(none, middle, upper), np.where(none, lower, middle)
    return upper


def _none_right_of(matrix: CharacteristicMatrix, abscissa: Floats, outer: Floats) -> Booleans:
    heights = np.linspace(1.0, 0.0, 400) ** 2 * outer[:, None]
    values = matrix.determinant(abscissa[:, None] + 1j * heights)
    turns, ambiguous = crossings(values)
    clear: Booleans = (turns == 0.0) & ~ambiguous.any(axis=1) & (values[:, -1].real > 0.0)
    return clear


@dataclass(frozen=True)
class _Scaled:
    """det M / Π (σ + ρ)^ℓ of one block: finite at the origin, 1 at infinity, with the zeros of det M for Re σ > 0."""

    matrix: CharacteristicMatrix
    block: list[int]
    rho: float

    def factor(self, sigma: Complexes) -> Complexes:
        """Return Π (σ / (σ + ρ))^ℓ, which leads there from det M̃."""
        factor: Complexes = (sigma / (sigma + self.rho)) ** self.matrix.highest[self.block].sum()
        return factor

    def __call__(self, sigma: Complexes, rows: Array) -> Complexes:
        """Return the values for some members, at nodes (k,) or (b, k)."""
        return self.matrix.take(rows).determinant(sigma, self.block) * self.factor(sigma)


def _turns(matrix: CharacteristicMatrix, block: list[int], path: Complexes) -> tuple[Floats, Booleans]:
    """Return phase change over 2π along `path` (b,), and whether every step of it was resolved."""
    function = _Scaled(matrix, block, abs(path[0]) / (4.0 * len(block)))
    everyone = np.arange(matrix.batch)
    if len(block) > 2:
        values = function(path, everyone)
        turns, ambiguous = _counted(values)
        doubtful, last = ambiguous.any(axis=1), values[:, -1].real
    else:
        factor = function.factor(path)
        tables = matrix.tables(block, lambda exponents: _table(path, exponents))
        counts, doubtful, last = follow(tables, np.ascontiguousarray(factor.real), np.ascontiguousarray(factor.imag))
        turns = counts.astype(np.float64)
    turns = turns + 0.5 * (last < 0.0)
    resolved = np.ones(matrix.batch, dtype=bool)
    again = np.flatnonzero(doubtful)
    if again.size:
        turns[again], resolved[again] = _refined(function, again, path)
    return turns, resolved


def _table(path: Complexes, exponents: Floats) -> tuple[Floats, Floats]:
    values = powers(path, np.atleast_2d(exponents))
    return np.ascontiguousarray(values.real), np.ascontiguousarray(values.imag)


def _counted(values: Complexes) -> tuple[Floats, Booleans]:
    """Count as `crossings` does, and mark too each step next to which the function changes by its own size.

    Two zeros close to each other and to the path turn the phase by 2π within a step that they leave no other
    trace in than the rate at which the magnitude changes around it.
    """
    turns, ambiguous = crossings(values)
    difference = np.diff(values, axis=1)
    change = np.abs(difference.real) + np.abs(difference.imag)
    around = change.copy()
    around[:, 1:] = np.maximum(around[:, 1:], change[:, :-1])
    around[:, :-1] = np.maximum(around[:, :-1], change[:, 1:])
    size = np.abs(values.real) + np.abs(values.imag)
    doubtful = around > LARGEST_CHANGE * (size[:, 1:] + size[:, :-1])
    counted = crossings(values, doubtful)[0] if doubtful.any() else turns
    return counted, ambiguous | doubtful


def _refined(function: _Scaled, members: Array, path: Complexes) -> tuple[Floats, Booleans]:
    """Halve the doubtful steps until none is, or they are as short as rounding."""
    values = function(path, members)
    turns, ambiguous = _counted(values)
    resolved = np.ones(len(turns), dtype=bool)
    rows, steps = np.nonzero(ambiguous)
    left, right = path[steps], path[steps + 1]
    left_value, right_value = values[rows, steps], values[rows, steps + 1]
    while rows.size:
        middle = _between(left, right)
        value = function(middle[:, None], members[rows])[:, 0]
        stuck = np.abs(right - left) < _SMALLEST_STEP * np.abs(middle)
        resolved[rows[stuck]] = False
        _, open_ = _counted(np.stack([left_value, value, right_value], axis=1))
        pending = []
        for i, (a, value_a, b, value_b) in enumerate(
            [(left, left_value, middle, value), (middle, value, right, right_value)]
        ):
            done = ~open_[:, i]
            turn, _ = crossings(np.stack([value_a, value_b], axis=1)[done])
            np.add.at(turns, rows[done], turn)
            again = open_[:, i] & ~stuck
            pending.append((rows[again], a[again], b[again], value_a[again], value_b[again]))
        rows, left, right, left_value, right_value = (np.concatenate(part) for part in zip(*pending, strict=True))
    return turns + 0.5 * (values[:, -1].real < 0.0), resolved


def _between(left: Complexes, right: Complexes) -> Complexes:
    """Midpoint along the line or the arc that joins two neighbours of the path."""
    radius = np.sqrt(np.abs(left) * np.abs(right))
    middle: Complexes = radius * np.exp(0.5j * (np.angle(left) + np.angle(right)))
    return middle


def crossings(values: Complexes, skipped: Booleans | None = None) -> tuple[Floats, Booleans]:
    """Count crossings of the negative real axis, counter-clockwise ones as +1, along (b, k).

    A step that turns by more than a right angle is ambiguous: it is marked in (b, k - 1) and, as the `skipped`
    steps, not counted.
    """
    re, im = values.real, values.imag
    re0, im0, re1, im1 = re[:, :-1], im[:, :-1], re[:, 1:], im[:, 1:]
    ambiguous = re0 * re1 + im0 * im1 <= 0.0
    below = im < 0.0
    turned = below[:, 1:] != below[:, :-1]
    through_left = (re0 * im1 - re1 * im0) * (im1 - im0) < 0.0
    crossed = turned & through_left & ~ambiguous
    if skipped is not None:
        crossed &= ~skipped
    downward = below[:, 1:]
    turns: Floats = (crossed & downward).sum(axis=1) - (crossed & ~downward).sum(axis=1).astype(np.float64)
    return turns, ambiguous


def _at_origin(matrix: CharacteristicMatrix, turns: Floats) -> tuple[Floats, Booleans]:
    """Complete the count by the zeros in (0, inner radius); mark loops with a zero at the origin itself.

    Where no order is negative det M(0) is finite, and a sign of it that differs from the sign at the inner radius
    tells of an odd number of real zeros between.
    """
    zeros = 2.0 * turns
    terms = matrix.system.dynamics
    if any(np.any(term.orders < 0.0) for term in terms):
        return zeros, np.zeros(len(zeros), dtype=bool)
    static = np.zeros((matrix.batch, matrix.size, matrix.size))
    for term in terms:
        static = static + term.matrix * (term.orders == 0.0)[..., None, :]
    at_zero = np.linalg.det(static)
    scale = np.prod(np.maximum(np.abs(static).sum(axis=-1), 1e-300), axis=-1)
    inner = matrix.determinant(np.array([_INNER + 0j]))[:, 0].real
    zeros = zeros + (np.sign(at_zero) * np.sign(inner) < 0)
    return zeros, np.abs(at_zero) <= 1e-13 * np.maximum(scale, 1.0)
