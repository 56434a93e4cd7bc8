"""The number of poles right of a line, by the argument principle.

det M̃ is followed along a path that closes in the upper right quarter: from a real point beyond all zeros along an
arc to the line Re σ = a, down the line, and by a small arc around the branch point back to the real axis. By the
symmetry of det M̃ about the real axis, the number of zeros to the right is the change of phase over π.

No path is needed for one coordinate where Im M(i r) = Σ c r^β sin(β π/2) has one sign for all r.
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.doubts import zeros_with_doubts
from fracctl.characteristic.equation import Equation, equations
from fracctl.characteristic.matrix import CharacteristicMatrix, Powers
from fracctl.characteristic.phase import COUNTED, DOUBTFUL, SHORT, zeros_to_the_right
from fracctl.fractional.terms import turned

_INNER, _INNERMOST = np.log(1e-5), -1e5
"""Logarithms of the radii at which a path ends, at first and at most."""
_STEP = np.log(1.2)
"""Of the path along the axis, in the logarithm of the radius; beyond the inner end it grows with that."""


def unstable_zeros(matrix: CharacteristicMatrix, radius: Floats | None = None) -> tuple[Floats, Booleans]:
    """Count the zeros of det M̃ with Re σ > 0.

    Args:
        matrix: the characteristic matrix of a batch of b loops.
        radius: its `pole_radius`, if that is known already.

    Returns:
        The counts (b,), and whether (b,) a zero lies on the imaginary axis to rounding; then the count is that of the
        coordinates that are not coupled to it, and so a lower bound.
    """
    radius = pole_radius(matrix) if radius is None else radius
    zeros, resolved = np.zeros(matrix.batch), np.ones(matrix.batch, dtype=bool)
    for block in matrix.blocks():
        outer = float(np.log(radius.max() * _near_identity(matrix.powers_of(block), len(block))))
        for rows, equation in equations(matrix, block):
            found, clear, decided = _by_sign(equation, matrix.highest[block])
            undecided = np.flatnonzero(~decided & (np.abs(equation.limit) > equation.vanishing))
            if len(undecided):
                part = equation if len(undecided) == len(rows) else equation.take(undecided)
                found[undecided], clear[undecided] = _followed(part, outer)
            zeros[rows] += np.where(clear, found, 0.0)
            resolved[rows] &= clear
    return zeros, ~resolved


def verdicts(zeros: Floats, marginal: Booleans) -> Array:
    """Return what `unstable_zeros` has found as True, False, or None for nobody knows, (b,) objects."""
    stable = np.array(zeros == 0.0, dtype=object)
    stable[marginal & (zeros == 0.0)] = None
    return stable


def _by_sign(equation: Equation, highest: Floats) -> tuple[Floats, Booleans, Booleans]:
    """Count the zeros of one coordinate where Im M has one sign on the upper imaginary axis, or is 0.

    From a phase of ℓ π/2 at infinity, M then goes to the origin through the upper half plane alone, or the lower. Where
    M is real, it is σ² + M(0), with two zeros on the axis or one on the right.

    Returns:
        The counts, whether no zero lies on the axis, and whether these are known, (b,) each.
    """
    if len(highest) > 1:
        none = np.zeros(len(equation.limit), dtype=bool)
        return np.zeros(len(none)), none, none.copy()
    divided = (equation.degree - highest)[:, None]
    lift = equation.coefficients * turned(np.round(equation.orders - divided, 12)).imag
    up, down = (lift > 0.0).any(axis=1), (lift < 0.0).any(axis=1)
    negative, known = equation.limit < 0.0, np.abs(equation.limit) > equation.vanishing
    zeros = np.where(negative, 1.0, np.where(down, 2.0, 0.0))
    return zeros, known & ((up != down) | (negative & ~up & ~down)), known & ~(up & down)


def _followed(equation: Equation, outer: float) -> tuple[Floats, Booleans]:
    """Count along a path, and along a longer one where it ends too early."""
    line = outer - _STEP * np.arange(-1.0, 2.0 + (outer - _INNER) / _STEP)
    zeros, resolved, short = _counted(equation, line)
    if len(short):
        growth = 1.0 - _STEP / line[-1]
        further = line[-1] * growth ** np.arange(1.0, 1.0 + np.log(_INNERMOST / line[-1]) / np.log(growth))
        zeros[short], resolved[short], _ = _counted(equation.take(short), np.append(line, further))
    return zeros, resolved


def _counted(equation: Equation, line: Floats) -> tuple[Floats, Booleans, Array]:
    """Count along a path, in shorter steps where they are doubtful; say what is resolved, and what ends too early."""
    c, orders, place, degree, limit, sums, _, gone = equation
    rho = float(line[0] - np.log(2.0 * degree.max()))
    zeros, outcome, lasts = zeros_to_the_right(c, orders, place, degree, limit, sums, line, rho, gone)
    resolved, doubtful = outcome == COUNTED, np.flatnonzero(outcome == DOUBTFUL)
    if len(doubtful):
        c, orders, place, degree, _, sums, _, _ = equation.take(doubtful)
        zeros[doubtful], resolved[doubtful] = zeros_with_doubts(
            c, orders, place, degree, sums, line, rho, lasts[doubtful]
        )
    return zeros, resolved, np.flatnonzero(outcome == SHORT)


def _near_identity(powers: Powers, size: int) -> float:
    """Return what multiple of the pole radius begins a path: det M̃ has a phase below 2.5 rad there.

    Beyond the radius the p eigenvalues of N are below (R/r)^e, e the least exponent, and their phase in det (I + N)
    is below that angle's sine each.
    """
    falling = -powers.exponents[powers.exponents < 0.0]
    steepness = float(falling.min()) if falling.size else 1.0
    return float(np.sin(min(2.5 / size, 0.5 * np.pi)) ** (-1.0 / steepness))


def abscissa_bound(matrix: CharacteristicMatrix, resolution: float) -> Floats:
    """Return a (b,), a bound on the real parts of all poles that exceeds the largest by at most `resolution`.

    Meant for loops with a pole in the right half plane; bisection on the number of zeros right of Re σ = a.
    """
    upper = pole_radius(matrix)
    lower, outer = np.zeros_like(upper), 2.0 * upper
    while np.max(upper - lower) > resolution:
        middle = 0.5 * (lower + upper)
        none = _none_right_of(matrix, middle, outer)
        upper, lower = np.where(none, middle, upper), np.where(none, lower, middle)
    return upper


def _none_right_of(matrix: CharacteristicMatrix, abscissa: Floats, outer: Floats) -> Booleans:
    heights = np.linspace(1.0, 0.0, 400) ** 2 * outer[:, None]
    values = matrix.determinant(abscissa[:, None] + 1j * heights)
    steps = np.angle(values[:, 1:] * values[:, :-1].conj())
    small, turned = (np.abs(steps) < 0.5 * np.pi).all(axis=1), np.angle(values[:, 0]) + steps.sum(axis=1)
    clear: Booleans = small & (np.abs(turned) < 1.0)
    return clear
