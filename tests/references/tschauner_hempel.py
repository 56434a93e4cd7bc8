"""Free motion relative to a leader on an elliptic orbit in closed form, in arbitrary precision.

Yamanaka and Ankersen, New state transition matrix for relative motion on an arbitrary elliptical orbit (2002), turned
from their axes (along-track, -normal, -radial) into (radial, along-track, normal).
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np


def transition(e: float, true_anomaly: float, time: Any, digits: int = 30) -> np.ndarray:
    """Φ(time, 0) over [x, y, z, x', y', z'] with time over 1/n, (6, 6); of mpf where more than 30 digits are asked."""
    with mpmath.workdps(digits):
        e_, first = mpmath.mpf(float(e)), mpmath.mpf(float(true_anomaly))
        eccentric = 2 * mpmath.atan2(
            mpmath.sqrt(1 - e_) * mpmath.sin(first / 2), mpmath.sqrt(1 + e_) * mpmath.cos(first / 2)
        )
        mean = eccentric - e_ * mpmath.sin(eccentric) + mpmath.mpf(time)
        later = mpmath.findroot(lambda x: x - e_ * mpmath.sin(x) - mean, mean + e_ * mpmath.sin(mean))
        last = 2 * mpmath.atan2(
            mpmath.sqrt(1 + e_) * mpmath.sin(later / 2), mpmath.sqrt(1 - e_) * mpmath.cos(later / 2)
        )
        start = _fundamental(e_, first, mpmath.mpf(0))
        value = _fundamental(e_, last, mpmath.mpf(time)) * mpmath.inverse(start)
        exact = np.array(value.tolist(), dtype=object)
        return exact if digits > 30 else exact.astype(float)


def _fundamental(e: Any, f: Any, time: Any) -> Any:
    """Six solutions as columns, [x, y, z] and rates over time, with J = n t/(1 - e²)^(3/2)."""
    rho, sine, cosine = 1 + e * mpmath.cos(f), mpmath.sin(f), mpmath.cos(f)
    s, c = rho * sine, rho * cosine
    ds, dc = cosine + e * mpmath.cos(2 * f), -(sine + e * mpmath.sin(2 * f))
    j = time / (1 - e * e) ** mpmath.mpf("1.5")
    x = [0, s, c, 2 - 3 * e * s * j, 0, 0]
    dx = [0, ds, dc, -3 * e * (ds * j + s / rho**2), 0, 0]
    y = [-1, c * (1 + 1 / rho), -s * (1 + 1 / rho), -3 * rho**2 * j, 0, 0]
    dy = [0, -2 * s, e - 2 * c, -3 * (1 - 2 * e * s * j), 0, 0]
    z, dz = [0, 0, 0, 0, cosine, sine], [0, 0, 0, 0, -sine, cosine]
    rate = rho**2 / (1 - e * e) ** mpmath.mpf("1.5")
    matrix = mpmath.zeros(6, 6)
    for row, (value, slope) in enumerate(((x, dx), (y, dy), (z, dz))):
        for k in range(6):
            matrix[row, k] = value[k] / rho
            matrix[row + 3, k] = rate * (slope[k] + e * sine * value[k] / rho) / rho
    return matrix
