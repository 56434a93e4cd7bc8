"""Solutions without a Laplace inversion: power series, Mittag-Leffler functions, matrix exponentials, free motion.

Power series. Integrated twice, the loop ξ'' = S ξ + D ξ' - K_P ξ - K_D D^α ξ reads

    ξ = ξ₀ + ξ₀' s + I² (S - K_P) ξ + I D (ξ - ξ₀) - Σ_j I^(2-α_j) K_D e_j e_jᵀ (ξ - ξ₀),

and with e_β = s^β/Γ(β+1), I^γ e_β = e_{β+γ}, the coefficients on the lattice β = n + Σ_j k_j (2 - α_j) follow from one
another. The series converges for all s; terms reach about e^(|λ| s), so precision is raised by as much.

Mittag-Leffler. E_{a,b}(z) = Σ z^k/Γ(a k + b); Podlubny, Fractional Differential Equations (1999), Eqs. 1.80 and 5.26.

Free motion. Clohessy and Wiltshire (1960) with s = n t, u radial, v along-track, w normal.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import mpmath
import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from tests.references.loops import Loop
from tests.references.poles import companion, is_integer_order

Floats = NDArray[np.float64]


def power_series(loop: Loop, time: float, digits: int = 25) -> list[Any]:
    """Return ξ(time), m mpmath numbers, right to about `digits` digits of ξ₀.

    The cost grows with the power m + 1 of the number of terms: good for time · |λ| up to 30 (m = 1) or 6 (m = 2).
    """
    m = range(loop.size)
    size = float(np.linalg.norm(loop.k_p - loop.stiffness) + np.linalg.norm(loop.k_d) + np.linalg.norm(loop.damping))
    # A step of order 2-α or 2 brings in a factor `size`: terms are below growth^β/Γ(β+1).
    growth = max(size, 1.0) ** (1.0 / float(np.min(2.0 - loop.alpha))) * time
    top = _last_order(growth, digits)
    with mpmath.workdps(digits + int(growth / 2.3) + 10):
        shift = [2 - mpmath.mpf(float(a)) for a in loop.alpha]
        value = tuple(mpmath.mpf(float(x)) for x in loop.value)
        zero = tuple(mpmath.mpf(0) for _ in m)
        base = (0,) * (loop.size + 1)
        stiffness = [[mpmath.mpf(float(loop.stiffness[i, j])) - float(loop.k_p[i, j]) for j in m] for i in m]
        table = {base: value}
        total, t = list(value), mpmath.mpf(time)
        limits = [int(top) + 1] + [int(top / float(s)) + 1 for s in shift]
        for index in itertools.product(*[range(limit) for limit in limits]):
            beta = index[0] + mpmath.fsum(k * s for k, s in zip(index[1:], shift, strict=True))
            if index == base or beta > top:
                continue
            twice = table.get((index[0] - 2, *index[1:]), zero)
            once = _without(base, table, (index[0] - 1, *index[1:]), zero)
            term = [mpmath.fsum(stiffness[i][j] * twice[j] + float(loop.damping[i, j]) * once[j] for j in m) for i in m]
            for j in m:
                lower = list(index)
                lower[j + 1] -= 1
                part = _without(base, table, tuple(lower), zero)[j]
                term = [term[i] - float(loop.k_d[i, j]) * part for i in m]
            if index == (1,) + (0,) * loop.size:
                term = [term[i] + float(loop.rate[i]) for i in m]
            table[index] = tuple(term)
            factor = t**beta * mpmath.rgamma(beta + 1)
            total = [total[i] + term[i] * factor for i in m]
        return total


def _last_order(growth: float, digits: int) -> float:
    """Return β beyond which growth^β/Γ(β+1) < 10^-digits."""
    order = 1.0
    while math.lgamma(order + 1.0) - order * math.log(growth) < math.log(10.0) * (digits + 2) or order < growth:
        order += 1.0
    return order


def _without(base: tuple[int, ...], table: dict[tuple[int, ...], Any], index: tuple[int, ...], zero: Any) -> Any:
    """Return the coefficient of ξ - ξ₀."""
    return zero if index == base else table.get(index, zero)


def mittag_leffler(a: float, b: float, z: Any) -> Any:
    """Return E_{a,b}(z) for real z by its series, to the working precision."""
    digits = mpmath.mp.dps
    with mpmath.workdps(digits + int(abs(float(z)) ** (1.0 / a) / 2.3) + 10):
        a, b, z = mpmath.mpf(a), mpmath.mpf(b), mpmath.mpf(z)
        total, power, k = mpmath.mpf(0), mpmath.mpf(1), 0
        while True:
            term = power * mpmath.rgamma(a * k + b)
            total += term
            if k > abs(z) ** (1 / a) + 5 and abs(term) < mpmath.mpf(10) ** (-digits - 5):
                return total
            power *= z
            k += 1


def damped_free_mass(k_d: float, alpha: float, value: float, rate: float, time: float) -> Any:
    """Return w(time) of w'' + k_D D^α w = 0:  w = w₀ + w₀' s E_{2-α,2}(-k_D s^(2-α))."""
    s, order = mpmath.mpf(time), 2 - mpmath.mpf(alpha)
    return value + rate * s * mittag_leffler(order, 2, -k_d * s**order)


def fractional_oscillator(k_d: float, c: float, alpha: float, value: float, rate: float, time: float) -> Any:
    """Return w(time) of w'' + k_D D^α w + c w = 0 (Bagley-Torvik form) by Podlubny's double series.

    w = w₀ (1 - c ∫g) + w₀' g,
    g = Σ_m (-1)^m Σ_j C(m, j) c^j k_D^(m-j) s^(2m+1-α(m-j)) / Γ(2m+2-α(m-j))
    """
    digits = mpmath.mp.dps
    scale = max(float(k_d) ** (1 / (2 - alpha)), float(c) ** 0.5)
    with mpmath.workdps(digits + int(2 * scale * time / 2.3) + 10):
        s, a, k, stiff = (mpmath.mpf(x) for x in (time, alpha, k_d, c))
        green = integral = mpmath.mpf(0)
        m, layer = 0, mpmath.inf
        while m <= scale * time or layer >= mpmath.mpf(10) ** (-digits - 5):
            layer = mpmath.mpf(0)
            for j in range(m + 1):
                beta = 2 * m + 1 - a * (m - j)
                factor = (-1) ** m * mpmath.binomial(m, j) * stiff**j * k ** (m - j)
                term = factor * s**beta * mpmath.rgamma(beta + 1)
                green += term
                integral += term * s / (beta + 1)
                layer += abs(term)
            m += 1
        return value * (1 - stiff * integral) + rate * green


def matrix_exponential(loop: Loop, times: ArrayLike) -> tuple[Floats, Floats]:
    """Return states (t, 2m) and controls (t, m) of a loop whose orders are all 1, by scipy.linalg.expm."""
    assert is_integer_order(loop)
    matrix = companion(loop)
    states = np.array([scipy.linalg.expm(matrix * t) @ loop.start for t in np.asarray(times, float).ravel()])
    return states, -states @ np.hstack([loop.k_p, loop.k_d]).T


def precise_matrix_exponential(loop: Loop, time: float) -> list[Any]:
    """Return the 2m states of a loop whose orders are all 1 to the working precision, by mpmath.expm."""
    assert is_integer_order(loop)
    m = loop.size
    matrix = mpmath.zeros(2 * m)
    for i, j in itertools.product(range(m), range(m)):
        matrix[i, m + j] = int(i == j)
        matrix[m + i, j] = mpmath.mpf(float(loop.stiffness[i, j])) - float(loop.k_p[i, j])
        matrix[m + i, m + j] = mpmath.mpf(float(loop.damping[i, j])) - float(loop.k_d[i, j])
    return list(mpmath.expm(matrix * mpmath.mpf(time), method="taylor") * mpmath.matrix(loop.start.tolist()))


def free_in_plane(start: ArrayLike, times: ArrayLike) -> Floats:
    """Return [u v u' v'] (t, 4) of the uncontrolled motion u'' = 2v' + 3u, v'' = -2u'."""
    u0, v0, du0, dv0 = np.asarray(start, float)
    s = np.asarray(times, float).ravel()
    sin, cos = np.sin(s), np.cos(s)
    u = (4.0 - 3.0 * cos) * u0 + sin * du0 + 2.0 * (1.0 - cos) * dv0
    v = 6.0 * (sin - s) * u0 + v0 - 2.0 * (1.0 - cos) * du0 + (4.0 * sin - 3.0 * s) * dv0
    du = 3.0 * sin * u0 + cos * du0 + 2.0 * sin * dv0
    dv = -6.0 * (1.0 - cos) * u0 - 2.0 * sin * du0 + (4.0 * cos - 3.0) * dv0
    return np.stack([u, v, du, dv], axis=1)


def free_out_of_plane(start: ArrayLike, times: ArrayLike) -> Floats:
    """Return [w w'] (t, 2) of the uncontrolled motion w'' = -w."""
    w0, dw0 = np.asarray(start, float)
    s = np.asarray(times, float).ravel()
    return np.stack([w0 * np.cos(s) + dw0 * np.sin(s), -w0 * np.sin(s) + dw0 * np.cos(s)], axis=1)
