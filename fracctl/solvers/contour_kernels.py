"""Compiled loops that finish a response: controls from derivatives, peaks, and what is left of the interpolation."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.kernels import compiled


@compiled
def place(
    main: Floats,
    other: Floats,
    checked: Array,
    coefficient: Floats,
    shape: Floats,
    values: Floats,
    difference: Floats,
) -> None:
    """Write one derivative on one window, and how far the two rules differ.

    Args:
        main: (σ^e Z)(t) by the midpoint rule, (k, b, t).
        other: the same by the trapezoidal rule at the checked times, (k, b, c).
        checked: which of the times these are, (c,).
        coefficient: what the initial value adds, (k, b), times
        shape: a function of time, (1 or b, t).
        values: out, (k, b, t).
        difference: out, (k, b).
    """
    k, b, nodes = main.shape
    for j in range(k):
        for i in range(b):
            worst = 0.0
            for c in range(len(checked)):
                gap = abs(main[j, i, checked[c]] - other[j, i, c])
                worst = gap if not gap <= worst else worst
            difference[j, i] = worst
            factor, own = coefficient[j, i], min(i, len(shape) - 1)
            for n in range(nodes):
                values[j, i, n] = main[j, i, n] + factor * shape[own, n]


@compiled
def controls_and_errors(
    values: Floats, differences: Floats, gains: Floats, offsets: Array, last: Floats, positions: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Combine derivatives to controls, and bound the errors of positions and controls.

    Args:
        values: derivatives of coordinates at the nodes, (w, k, b, T); the first `positions` are the positions.
        differences: largest difference of the two rules for each, (w, k, b, c).
        gains: υ_i = Σ_w gains[b, i, w] values[w], (b, m, w).
        offsets: first node of each panel, and T.
        last: weights of the last three Chebyshev coefficients of each panel, (3, T).
        positions: m.

    Returns:
        Controls (k, b, m, T), peaks of positions and of controls (2, k, b), largest last coefficient (2, k, b) and
        largest difference (2, k, b).
    """
    count, k, b, nodes = values.shape
    m = gains.shape[1]
    controls = np.zeros((k, b, m, nodes))
    peaks, tails, worst = np.zeros((2, k, b)), np.zeros((2, k, b)), np.zeros((2, k, b))
    for j in range(k):
        for i in range(b):
            for row in range(positions):
                peaks[0, j, i] = max(peaks[0, j, i], _largest(values[row, j, i]))
                tails[0, j, i] = max(tails[0, j, i], _tail(values[row, j, i], offsets, last))
                worst[0, j, i] = max(worst[0, j, i], _largest(differences[row, j, i]))
            for row in range(m):
                out = controls[j, i, row]
                difference = 0.0
                for w in range(count):
                    gain = gains[i, row, w]
                    if gain != 0.0:
                        for n in range(nodes):
                            out[n] += gain * values[w, j, i, n]
                        difference += abs(gain) * _largest(differences[w, j, i])
                peaks[1, j, i] = max(peaks[1, j, i], _largest(out))
                tails[1, j, i] = max(tails[1, j, i], _tail(out, offsets, last))
                worst[1, j, i] = max(worst[1, j, i], difference)
    return controls, peaks, tails, worst


@compiled
def _largest(row: Floats) -> float:
    """Largest magnitude; NaN if there is one. Four running maxima, for one would wait for itself at every step."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    stop = len(row) - len(row) % 4
    total = 0.0
    for n in range(0, stop, 4):
        p, q, r, s = abs(row[n]), abs(row[n + 1]), abs(row[n + 2]), abs(row[n + 3])
        a, b, c, d = max(a, p), max(b, q), max(c, r), max(d, s)
        total += (p + q) + (r + s)
    for n in range(stop, len(row)):
        a = max(a, abs(row[n]))
        total += row[n]
    return max(a, b, c, d) if total == total else np.nan


@compiled
def _tail(row: Floats, offsets: Array, last: Floats) -> float:
    """Largest of the last three Chebyshev coefficients of any panel."""
    largest = 0.0
    for panel in range(len(offsets) - 1):
        first, stop = offsets[panel], offsets[panel + 1]
        for k in range(3):
            total = 0.0
            for n in range(first, stop):
                total += row[n] * last[k, n]
            largest = max(largest, abs(total))
    return largest
