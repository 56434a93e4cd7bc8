"""Compiled search for the zeros of det M̃ of one loop, in the variable z = log σ.

In z the determinant is an entire function, so that neither Newton's iteration nor the count meets a cut; the principal
sheet is the strip |Im z| < π. Both need d log det M̃/dz = tr(M̃⁻¹ dM̃/dz) only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.compiling import compiled_with

_LONGEST_STEP = 0.1
_SHORTEST_STEP = 1e-9
"""Of the path, in z; a zero nearer to the path than this is not told from one on it."""
_MOST_ITERATIONS = 60
_SETTLED = 1e-13
"""Newton step, relative to σ, at which a zero is found."""
_REAL = 1e-7
"""Angle to the positive real axis below which a zero lies on it; that of a double one is not better known."""


class Terms(NamedTuple):
    """M̃ as a list of K powers c σ^e, each in its row and column."""

    size: int
    coefficients: Floats
    exponents: Floats
    rows: Array
    columns: Array
    """(K,)."""


@compiled_with()
def logarithmic_derivative(terms: Terms, z: complex) -> tuple[complex, complex]:
    """Return det M̃ and tr(M̃⁻¹ dM̃/dz) at σ = e^z; a huge second one where det M̃ = 0."""
    p = terms.size
    work = np.zeros((p, 2 * p), np.complex128)
    for t in range(len(terms.coefficients)):
        value = terms.coefficients[t] * np.exp(terms.exponents[t] * z)
        work[terms.rows[t], terms.columns[t]] += value
        work[terms.rows[t], p + terms.columns[t]] += terms.exponents[t] * value
    det = _eliminate(work)
    if det == 0.0:
        return 0.0j, complex(1e300)
    trace = 0.0j
    for k in range(p):
        trace += work[k, p + k]
    return det, trace


@compiled_with()
def _eliminate(work: Complexes) -> complex:
    """Turn [A, B] into [I, A⁻¹B] in place; return det A, 0 where it stops at a pivot of 0."""
    p, det = len(work), 1.0 + 0.0j
    for k in range(p):
        best = k + np.argmax(np.abs(work[k:, k]))
        pivot = work[best, k]
        if pivot == 0.0:
            return 0.0j
        if best != k:
            det = -det
            for j in range(2 * p):
                work[k, j], work[best, j] = work[best, j], work[k, j]
        det *= pivot
        for j in range(k, 2 * p):
            work[k, j] /= pivot
        for i in range(p):
            if i != k:
                factor = work[i, k]
                for j in range(k, 2 * p):
                    work[i, j] -= factor * work[k, j]
    return det


@compiled_with()
def phase_change(terms: Terms, corners: Complexes) -> float:
    """Return the change of arg det M̃ along straight lines in z from corner to corner.

    Steps are so short that the logarithmic derivative at both ends turns by less than a radian over them: a zero
    at a distance d allows steps of about d.
    """
    total = 0.0
    for corner in range(len(corners) - 1):
        here, end = corners[corner], corners[corner + 1]
        value, slope = logarithmic_derivative(terms, here)
        while here != end:
            step = min(_LONGEST_STEP, 0.5 / (abs(slope) + 1e-300), abs(end - here))
            while True:
                step = max(step, _SHORTEST_STEP)
                last = step >= abs(end - here)
                there = end if last else here + step * (end - here) / abs(end - here)
                next_value, next_slope = logarithmic_derivative(terms, there)
                if abs(next_slope) * step < 1.0 or step <= _SHORTEST_STEP:
                    break
                step *= 0.5
            total += np.angle(next_value / value)
            here, value, slope = there, next_value, next_slope
    return total


@compiled_with()
def search(terms: Terms, starts: Complexes, wanted: int, edge: float) -> Complexes:
    """Return up to `wanted` zeros with |Im z| < `edge`, each as often as it is one, with the conjugates.

    Newton's iteration from each start, with all zeros found so far divided out.
    """
    known = np.zeros(2 * len(starts), np.complex128)
    inside = np.zeros(2 * len(starts), np.bool_)
    n_known, found = 0, 0
    for start in starts:
        if found >= wanted:
            break
        z, settled = start, False
        for _ in range(_MOST_ITERATIONS):
            _, slope = logarithmic_derivative(terms, z)
            for i in range(n_known):
                slope -= 1.0 / (z - known[i] + 1e-300)
            if slope == 0.0 or not np.isfinite(slope):
                break
            step = -1.0 / slope
            z += step / max(1.0, 2.0 * abs(step))
            if abs(step) < _SETTLED:
                settled = True
                break
        if not settled:
            continue
        count = 1 if abs(z.imag) < _REAL else 2
        known[n_known : n_known + count] = complex(z.real) if count == 1 else z
        if count == 2:
            known[n_known + 1] = z.conjugate()
        inside[n_known : n_known + count] = abs(z.imag) < edge
        found += count if inside[n_known] else 0
        n_known += count
    return known[:n_known][inside[:n_known]]
