"""A circle that holds all poles of a loop."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.compiling import compiled

SMALLEST_RADIUS = 1e-2
"""Least bound that is returned, also for loops whose poles all lie at the origin."""
_RATIO = 1.4
"""Of two radii at which sums of powers are computed."""


def pole_radius(matrix: CharacteristicMatrix) -> Floats:
    """Return R (b,) such that every zero of det M̃ off the cut has |σ| < R.

    M̃(σ) = I + N(σ) is regular wherever a norm of N is below 1. With the row sums of Σ_e |c_e| r^e, which decrease
    in r, R is the radius at which the largest row sum is 1 (Cauchy's bound, for matrices and real exponents), or
    the same with column sums where that is smaller; both to 2 %, from above.
    """
    c, e, place = matrix.powers_of(list(range(matrix.size)))
    sums = np.empty((2, matrix.size))
    largest, slowest, top = np.abs(c).max(axis=0)[None], e.max(axis=0), 1.0
    while min(_norms(largest, 0, (top**slowest)[None], 0, place, sums)) > 1.0:
        top *= 2.0
    count = 2 + int(np.log(top / SMALLEST_RADIUS) / np.log(_RATIO))
    radii: Floats = _radii(c, e, place, sums, SMALLEST_RADIUS * np.power(_RATIO, np.arange(count)))
    return radii


@compiled
def _radii(coefficients: Floats, exponents: Floats, place: Array, sums: Floats, ladder: Floats) -> Floats:
    """Find where the norm of each member falls to 1.

    The logarithms of the sums are convex in log r, so that the chord between two radii of the ladder falls to 0
    beyond them. The search begins where that of the member before has ended.
    """
    found, logarithms = np.empty(len(coefficients)), np.log(ladder)
    table, owner = np.empty((len(ladder), len(place))), np.full(len(ladder), -1)
    k = 0
    for i in range(len(coefficients)):
        own = min(i, len(exponents) - 1)
        _tabulate(exponents, own, logarithms, k, table, owner)
        below, above = _norms(coefficients, i, table, k, place, sums), (0.0, 0.0)
        while min(below) > 1.0:
            k, above = k + 1, below
            _tabulate(exponents, own, logarithms, k, table, owner)
            below = _norms(coefficients, i, table, k, place, sums)
        while k > 0 and min(above) <= 1.0:
            _tabulate(exponents, own, logarithms, k - 1, table, owner)
            above = _norms(coefficients, i, table, k - 1, place, sums)
            if min(above) <= 1.0:
                k, below = k - 1, above
        found[i] = ladder[k]
        if k > 0:
            axis = 0 if below[0] <= below[1] else 1
            low, high = np.log(below[axis]), np.log(above[axis])
            found[i] *= np.exp(1e-9 + low / (high - low) * (logarithms[k] - logarithms[k - 1]))
    return found


@compiled
def _tabulate(exponents: Floats, own: int, logarithms: Floats, k: int, table: Floats, owner: Array) -> None:
    """Make row k of the table hold the powers of radius k with the exponents of member `own`."""
    if owner[k] != own:
        owner[k] = own
        for t in range(exponents.shape[1]):
            table[k, t] = np.exp(exponents[own, t] * logarithms[k])


@compiled
def _norms(c: Floats, i: int, table: Floats, k: int, place: Array, sums: Floats) -> tuple[float, float]:
    """Return the largest row sum and the largest column sum of N of member i, with the powers of row k of the table."""
    sums[:] = -1.0
    for t in range(len(place)):
        value = abs(c[i, t]) * table[k, t]
        sums[0, place[t, 0]] += value
        sums[1, place[t, 1]] += value
    row, column = 0.0, 0.0
    for j in range(sums.shape[1]):
        row, column = max(row, sums[0, j]), max(column, sums[1, j])
    return row, column
