"""Where all poles of a loop lie: within a circle, and within a strip along the real axis."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.matrix import CharacteristicMatrix, Entry
from fracctl.compiling import compiled

SMALLEST_RADIUS = 1e-2
"""Least bound that is returned, also for loops whose poles all lie at the origin."""
_RATIO, _FINE = 1.4, 1.03
"""Of two radii, or heights, at which sums of powers are computed."""
_NO_LAG = -1.0


def pole_radius(matrix: CharacteristicMatrix) -> Floats:
    """Return R (b,) such that every zero of det M̃ off the cut has |σ| < R.

    M̃(σ) = I + N(σ) is regular wherever a norm of N is below 1. With the row sums of Σ_e |c_e| r^e, which decrease
    in r, R is the radius at which the largest row sum is 1 (Cauchy's bound, for matrices and real exponents), or
    the same with column sums where that is smaller; both to 2 %, from above.
    """
    c, e, place = matrix.powers_of(list(range(matrix.size)))
    lags, sums = np.full((1, len(place)), _NO_LAG), np.empty((2, matrix.size))
    largest, slowest, top = np.abs(c).max(axis=0)[None], e.max(axis=0), 1.0
    while min(_norms(largest, lags, 0, top, (top**slowest)[None], 0, place, sums)) > 1.0:
        top *= 2.0
    radii: Floats = _radii(c, e, lags, place, sums, _ladder(top, _RATIO), True)
    return radii


def pole_height(matrix: CharacteristicMatrix, radius: Floats) -> Floats:
    """Return Y (b,), at most the pole radius, such that every zero of det M̃ off the cut has |Im σ| < Y, to 3 %.

    Lags z' = … - c z have poles near -c, however large, but hardly raise the imaginary parts. With them eliminated,
    entries are powers and c_e σ^e / (σ (σ + c)) with e ≤ 0; where |Im σ| ≥ y powers are bounded by those of y, and

        |σ (σ + c)| ≥ c y for y < c/2,  y² + c²/4 otherwise,

    the least product of the distances to the foci of Cassini's ovals. Y is where the largest row or column sum is 1.
    Laws with other auxiliary states keep the pole radius.
    """
    kept, gone = matrix.split(list(range(matrix.size)))
    terms = _reduced(matrix, kept, gone) if gone else None
    if terms is None:
        return radius
    place = np.array([(kept.index(i), kept.index(j)) for i, j, *_ in terms])
    c, e, lags = (_columns(list(values)) for values in list(zip(*terms, strict=True))[2:])
    c = np.ascontiguousarray(np.broadcast_to(c, (matrix.batch, len(place))))
    ladder = _ladder(1.01 * float(radius.max()), _FINE)
    return np.minimum(radius, _radii(c, e, lags, place, np.empty((2, len(kept))), ladder, False))


def _ladder(top: float, ratio: float) -> Floats:
    count = 2 + int(np.log(top / SMALLEST_RADIUS) / np.log(ratio))
    return np.asarray(SMALLEST_RADIUS * np.power(ratio, np.arange(count)))


_Term = tuple[int, int, Floats, Floats, Floats]
"""Row, column, coefficient, exponent e and c of a lag, or `_NO_LAG`."""


def _reduced(matrix: CharacteristicMatrix, kept: list[int], gone: list[int]) -> list[_Term] | None:
    """Return the terms of P - Q D⁻¹ R, or None where one is of another form."""
    none = np.array(_NO_LAG)
    terms = [(i, j, c, e, none) for i in kept for j in kept for c, e in _powers(matrix.entries[i][j])]
    for k in gone:
        own = [c for c, e in _powers(matrix.entries[k][k]) if np.all(e == -1.0)]
        if len(own) + 1 != len(_powers(matrix.entries[k][k])):
            return None
        pairs = [(i, j) for i in kept for j in kept]
        for i, j in pairs:
            for q, e_q in _powers(matrix.entries[i][k]):
                for r, e_r in _powers(matrix.entries[k][j]):
                    if np.max(e_q + e_r) > -2.0:
                        return None
                    terms.append((i, j, q * r, e_q + e_r + 2.0, np.asarray(own[0] if own else 0.0)))
    return terms


def _powers(entry: Entry | None) -> list[tuple[Floats, Floats]]:
    if entry is None:
        return []
    return [(entry.coefficients[..., j], entry.exponents[..., j]) for j in range(entry.exponents.shape[-1])]


def _columns(values: list[Floats]) -> Floats:
    """Return numbers () and one a member, (b,), as columns, (1, K) or (b, K)."""
    return np.stack(np.broadcast_arrays(*(np.atleast_1d(value) for value in values)), axis=1)


@compiled
def _radii(
    coefficients: Floats, exponents: Floats, lags: Floats, place: Array, sums: Floats, ladder: Floats, convex: bool
) -> Floats:
    """Find where the norm of each member falls to 1.

    The logarithms of sums of powers are convex in log r, so that the chord between two radii of the ladder falls to 0
    beyond them. The search begins where that of the member before has ended.
    """
    found, logarithms = np.empty(len(coefficients)), np.log(ladder)
    table, owner = np.empty((len(ladder), len(place))), np.full(len(ladder), -1)
    k = 0
    for i in range(len(coefficients)):
        own = min(i, len(exponents) - 1)
        _tabulate(exponents, own, logarithms, k, table, owner)
        below, above = _norms(coefficients, lags, i, ladder[k], table, k, place, sums), (0.0, 0.0)
        while min(below) > 1.0 and k + 1 < len(ladder):
            k, above = k + 1, below
            _tabulate(exponents, own, logarithms, k, table, owner)
            below = _norms(coefficients, lags, i, ladder[k], table, k, place, sums)
        while k > 0 and min(above) <= 1.0:
            _tabulate(exponents, own, logarithms, k - 1, table, owner)
            above = _norms(coefficients, lags, i, ladder[k - 1], table, k - 1, place, sums)
            if min(above) <= 1.0:
                k, below = k - 1, above
        found[i] = ladder[k]
        if k > 0 and convex:
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
def _norms(
    c: Floats, lags: Floats, i: int, radius: float, table: Floats, k: int, place: Array, sums: Floats
) -> tuple[float, float]:
    """Return the largest row sum and the largest column sum of N of member i, with the powers of row k of the table."""
    sums[:] = -1.0
    own = min(i, len(lags) - 1)
    for t in range(len(place)):
        value, lag = abs(c[i, t]) * table[k, t], lags[own, t]
        if lag >= 0.0:
            value /= lag * radius if radius < 0.5 * lag else radius * radius + 0.25 * lag * lag
        sums[0, place[t, 0]] += value
        sums[1, place[t, 1]] += value
    row, column = 0.0, 0.0
    for j in range(sums.shape[1]):
        row, column = max(row, sums[0, j]), max(column, sums[1, j])
    return row, column
