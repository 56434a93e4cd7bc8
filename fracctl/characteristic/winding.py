"""The number of poles right of a line, by the argument principle.

det M̃ is followed along a path that closes in the upper right quarter: from a real point beyond all zeros along an
arc to the line Re σ = a, down the line, and by a small arc around the branch point back to the real axis. By the
symmetry of det M̃ about the real axis, the number of zeros to the right is the change of phase over π.
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Booleans, Floats
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix, Powers
from fracctl.characteristic.phase import zeros_to_the_right

_INNER, _INNERMOST = np.log(1e-5), np.log(1e-250)
"""Logarithm of the radius at which a path ends at first, and of the least value of its power σ^Σℓ in det M̃."""
_STEP = np.log(1.2)
"""Of the path along the axis, in the logarithm of the radius."""
_VANISHING = 1e-13
"""Size of det M(0), relative to what it is computed from, below which there is a zero at the origin."""
_ARC = np.linspace(1.0, 0.0, 8)[1:]
"""Angles of the nodes around the branch point, in right angles."""


def unstable_zeros(matrix: CharacteristicMatrix, radius: Floats | None = None) -> tuple[Floats, Booleans]:
    """Count the zeros of det M̃ with Re σ > 0.

    Args:
        matrix: the characteristic matrix of a batch of b loops.
        radius: its `pole_radius`, if that is known already.

    Returns:
        The counts (b,), NaN where a zero lies on the imaginary axis to rounding, and whether (b,) the loop is
        marginal in that sense.
    """
    radius = pole_radius(matrix) if radius is None else radius
    zeros, resolved = np.zeros(matrix.batch), np.ones(matrix.batch, dtype=bool)
    row_sums = _static_row_sums(matrix)
    for block in matrix.blocks():
        kept, gone = matrix.split(block)
        powers, vanishing = matrix.powers_of(kept + gone), _VANISHING * row_sums[:, block].prod(axis=1)
        outer = float(np.log(radius.max() * _near_identity(powers, len(block))))
        found, clear = _counted(powers, matrix.highest[kept + gone], len(gone), vanishing, outer, _INNER)
        zeros += found
        resolved &= clear
    return np.where(resolved, zeros, np.nan), ~resolved


def _static_row_sums(matrix: CharacteristicMatrix) -> Floats:
    """Return row sums of |A_j| over all terms of order 0, (b, p): det M(0) is known to rounding of their products."""
    sums = np.zeros((matrix.batch, matrix.size))
    for term in matrix.system.dynamics:
        static = term.orders == 0.0
        if static.any():
            sums += (np.abs(term.matrix) * static[..., None, :]).sum(axis=-1)
    return sums


def _counted(
    powers: Powers, highest: Floats, gone: int, vanishing: Floats, outer: float, inner: float
) -> tuple[Floats, Booleans]:
    """Count along a path between two logarithms of radii, and along a longer one where it ends too early."""
    line = outer - _STEP * np.arange(-1.0, 2.0 + (outer - inner) / _STEP)
    zeros, resolved, short = zeros_to_the_right(*powers, highest, gone, vanishing, line, _ARC)
    if short.any() and 2.0 * inner * highest.sum() > _INNERMOST:
        rest = powers.take(short)
        zeros[short], resolved[short] = _counted(rest, highest, gone, vanishing[short], outer, 2.0 * inner)
    return zeros, resolved


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
