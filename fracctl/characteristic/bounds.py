"""Where all poles of a loop lie: within a circle, and within a strip along the real axis."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.matrix import CharacteristicMatrix, Entry
from fracctl.compiling import compiled, inlined
from fracctl.errors import UnsupportedError

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

    Raises:
        UnsupportedError: an order is so near the highest of its coordinate that R is beyond all numbers.
    """
    c, e, place = matrix.powers_of(list(range(matrix.size)))
    lags, largest, slowest, top = np.full((1, len(place)), _NO_LAG), np.abs(c).max(axis=0), e.max(axis=0), 1.0
    while min(np.bincount(axis, largest * top**slowest).max() for axis in place.T) > 2.0:
        top *= 2.0
        if not np.isfinite(top):
            gap = -slowest[slowest < 0.0].max()
            raise UnsupportedError(
                f"an order is only {gap:.3g} below the highest of its coordinate, so that poles may lie beyond all"
                " bounds; lower the order or drop the term"
            )
    radii: Floats = _radii(c, e, lags, place, matrix.size, _ladder(top, _RATIO), True)
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
    return np.minimum(radius, _radii(c, e, lags, place, len(kept), ladder, False))


def _ladder(top: float, ratio: float) -> Floats:
    """Return logarithms of radii."""
    count = 2 + int(np.log(top / SMALLEST_RADIUS) / np.log(ratio))
    return np.asarray(np.log(SMALLEST_RADIUS) + np.log(ratio) * np.arange(count))


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
    coefficients: Floats, exponents: Floats, lags: Floats, place: Array, size: int, ladder: Floats, convex: bool
) -> Floats:
    """Find where the norm of each member falls to 1; the ladder holds logarithms of radii.

    The logarithms of sums of powers are convex in log r, so that the chord between two radii of the ladder falls to 0
    beyond them. The search begins where that of the member before has ended.
    """
    found, norms = np.empty(len(coefficients)), np.empty((len(ladder), 2))
    sums, table = np.empty((2, size)), np.empty((len(ladder), len(place)))
    owner, seen = np.zeros(len(ladder), np.int64), np.zeros(len(ladder), np.int64)
    k, step = 0, 1
    for i in range(len(coefficients)):
        step = 1
        while step != 0:
            for at in range(max(k - 1, 0), k + 1):
                if seen[at] != i + 1:
                    seen[at] = i + 1
                    _take_norms(coefficients, i, exponents, lags, place, ladder, at, table, owner, sums, norms)
            step = 0
            if min(norms[k, 0], norms[k, 1]) > 1.0:
                step = 1 if k + 1 < len(ladder) else 0
            elif k > 0 and min(norms[k - 1, 0], norms[k - 1, 1]) <= 1.0:
                step = -1
            k += step
        found[i] = np.exp(ladder[k])
        if k > 0 and convex:
            axis = 0 if norms[k, 0] <= norms[k, 1] else 1
            low, high = np.log(norms[k, axis]), np.log(norms[k - 1, axis])
            found[i] *= np.exp(1e-9 + low / (high - low) * (ladder[k] - ladder[k - 1]))
    return found


@inlined
def _take_norms(
    c: Floats,
    i: int,
    exponents: Floats,
    lags: Floats,
    place: Array,
    ladder: Floats,
    k: int,
    table: Floats,
    owner: Array,
    sums: Floats,
    norms: Floats,
) -> None:
    """Write the largest row sum and the largest column sum of N of member i at radius k; tabulate powers for it."""
    own, radius = min(i, len(exponents) - 1), np.exp(ladder[k])
    if owner[k] != own + 1:
        owner[k] = own + 1
        for t in range(len(place)):
            table[k, t] = np.exp(exponents[own, t] * ladder[k])
    for axis in range(2):
        for j in range(sums.shape[1]):
            sums[axis, j] = -1.0
    for t in range(len(place)):
        value, lag = abs(c[i, t]) * table[k, t], lags[min(i, len(lags) - 1), t]
        if lag >= 0.0:
            value /= lag * radius if radius < 0.5 * lag else radius * radius + 0.25 * lag * lag
        sums[0, place[t, 0]] += value
        sums[1, place[t, 1]] += value
    for axis in range(2):
        norms[k, axis] = 0.0
        for j in range(sums.shape[1]):
            norms[k, axis] = max(norms[k, axis], sums[axis, j])
