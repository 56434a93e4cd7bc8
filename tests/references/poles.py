"""Principal-sheet poles of a loop, found by Newton's method and counted by the argument principle.

    det M(σ) = 0,    M(σ) = σ² I - D σ - S + K_P + K_D diag(σ^α),    |arg σ| < π

With z = log σ the determinant is an entire function of z, so Newton's method from a lattice of starts meets no cut.
The number of zeros follows from the change of arg det M along a path: det M is real on the positive axis and
conjugate for conjugate σ, so the upper half of the path is enough. For a loop whose orders are all 1 the determinant
is a polynomial and the poles are the eigenvalues of its companion matrix.

Origin: argument principle; Matignon (1996) for the meaning of the right half plane. Tolerance: poles are polished to
the working precision of mpmath; a count is an integer and its distance from one is checked to 1e-6.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from tests.references.loops import Floats, Loop

Complexes = NDArray[np.complex128]
NEAR_ZERO = -45.0
"""log of σ^α below which det M equals det M(0) in double precision."""


def matrix_entries(loop: Loop, sigma: Any, powers: list[Any]) -> list[list[Any]]:
    """Return M(σ) as nested lists; `sigma` and `powers` = σ^α are mpmath numbers or arrays of nodes."""
    m = range(loop.size)
    return [
        [
            (sigma * sigma if i == j else 0)
            - float(loop.damping[i, j]) * sigma
            + float(loop.k_d[i, j]) * powers[j]
            + float(loop.k_p[i, j])
            - float(loop.stiffness[i, j])
            for j in m
        ]
        for i in m
    ]


def determinant(entries: list[list[Any]]) -> Any:
    """Return the determinant of a 1×1 or 2×2 matrix."""
    if len(entries) == 1:
        return entries[0][0]
    return entries[0][0] * entries[1][1] - entries[0][1] * entries[1][0]


def determinant_slope(loop: Loop, sigma: Any, powers: list[Any]) -> Any:
    """Return d det M/dσ."""
    m = range(loop.size)
    alpha = [float(a) for a in loop.alpha]
    slope = [
        [
            (2 * sigma if i == j else 0)
            - float(loop.damping[i, j])
            + alpha[j] * (float(loop.k_d[i, j]) * powers[j] / sigma)
            for j in m
        ]
        for i in m
    ]
    if loop.size == 1:
        return slope[0][0]
    (a, b), (c, d) = matrix_entries(loop, sigma, powers)
    return slope[0][0] * d + a * slope[1][1] - slope[0][1] * c - b * slope[1][0]


def characteristic(loop: Loop, log_sigma: Complexes) -> Complexes:
    """Return det M at σ = e^z for an array of z, in double precision."""
    powers = [np.exp(a * log_sigma) for a in loop.alpha]
    return determinant(matrix_entries(loop, np.exp(log_sigma), powers))


def is_integer_order(loop: Loop) -> bool:
    """Whether all orders are 1, so that there is no cut."""
    return bool(np.all(loop.alpha == 1.0))


def pole_bound(loop: Loop) -> float:
    """Return R with no zero of det M in |σ| ≥ R: there σ² outweighs all other terms in the norm."""
    linear = np.linalg.norm(loop.damping, 2)
    constant = np.linalg.norm(loop.k_p - loop.stiffness, 2)
    fractional = np.linalg.norm(loop.k_d, 2)
    bound = 1.0
    while bound**2 <= 1.01 * (linear * bound + constant + fractional * bound ** float(loop.alpha.max())):
        bound *= 1.1
    return bound


def magnitude_bounds(loop: Loop, radius: Floats) -> tuple[Floats, Floats]:
    """Return bounds on |det M| and |d det M/dz|, z = log σ, for |σ| ≤ radius: sums of magnitudes of all powers."""
    m = range(loop.size)
    identity, damping, fractional = np.eye(loop.size), np.abs(loop.damping), np.abs(loop.k_d)
    constant = np.abs(loop.k_p - loop.stiffness)
    powers = [radius**a for a in loop.alpha]
    size = [
        [identity[i, j] * radius**2 + damping[i, j] * radius + constant[i, j] + fractional[i, j] * powers[j] for j in m]
        for i in m
    ]
    slope = [
        [
            2.0 * identity[i, j] * radius**2 + damping[i, j] * radius + loop.alpha[j] * fractional[i, j] * powers[j]
            for j in m
        ]
        for i in m
    ]
    if loop.size == 1:
        return size[0][0], slope[0][0]
    diagonal = slope[0][0] * size[1][1] + size[0][0] * slope[1][1]
    off_diagonal = slope[0][1] * size[1][0] + size[0][1] * slope[1][0]
    return size[0][0] * size[1][1] + size[0][1] * size[1][0], diagonal + off_diagonal


def argument_change(loop: Loop, path: Callable[[Floats], Complexes]) -> float:
    """Return the change of arg det M along the straight line z = path(p), 0 ≤ p ≤ 1.

    A step is halved until the bound on the slope of det M proves that it stays nearer to the value at one end of the
    step than to 0 on each half of it, so no turn can be missed.
    """
    p = np.linspace(0.0, 1.0, 401)
    values = characteristic(loop, path(p))
    for _ in range(60):
        z = path(p)
        magnitude, slope = magnitude_bounds(loop, np.exp(np.maximum(z.real[1:], z.real[:-1])))
        nearest = np.minimum(np.abs(values[1:]), np.abs(values[:-1]))
        if np.any(nearest < 1e-13 * magnitude):
            break
        wide = np.flatnonzero(0.5 * np.abs(np.diff(z)) * slope > 0.7 * nearest)
        if not wide.size:
            return float(np.angle(values[1:] / values[:-1]).sum())
        middle = 0.5 * (p[wide] + p[wide + 1])
        p = np.insert(p, wide + 1, middle)
        values = np.insert(values, wide + 1, characteristic(loop, path(middle)))
    raise ArithmeticError("det M vanishes on the path: the loop is marginal")


def _zeros_inside(loop: Loop, angle: float) -> int:
    log_bound, log_zero = np.log(pole_bound(loop)), NEAR_ZERO / float(loop.alpha.min())
    arc = argument_change(loop, lambda p: log_bound + 1j * angle * p)
    ray = argument_change(loop, lambda p: log_bound + (log_zero - log_bound) * p + 1j * angle)
    count = (arc + ray) / np.pi
    if abs(count - round(count)) > 1e-6:
        raise ArithmeticError(f"arg det M changes by {count} π: det M vanishes near 0")
    return round(count)


def unstable_count(loop: Loop) -> int:
    """Return the number of zeros of det M in Re σ > 0; 0 with nothing on the axis means stable (Matignon)."""
    return _zeros_inside(loop, np.pi / 2)


def sheet_count(loop: Loop) -> int:
    """Return the number of zeros of det M with |arg σ| < π."""
    return 2 * loop.size if is_integer_order(loop) else _zeros_inside(loop, np.pi)


def companion(loop: Loop) -> NDArray[np.float64]:
    """Return the matrix A of the state equation [ξ, ξ']' = A [ξ, ξ'] of a loop whose orders are all 1."""
    m = loop.size
    top = np.hstack([np.zeros((m, m)), np.eye(m)])
    return np.vstack([top, np.hstack([loop.stiffness - loop.k_p, loop.damping - loop.k_d])])


def _newton(loop: Loop, starts: int) -> Complexes:
    """Return the zeros of det M(e^z) with 0 ≤ Im z < π that Newton's method finds from a lattice of starts."""
    real, imaginary = np.meshgrid(
        np.linspace(-14.0, np.log(pole_bound(loop)), 2 * starts), np.linspace(0, np.pi, starts)
    )
    z = (real + 1j * imaginary).ravel()
    with np.errstate(all="ignore"):
        for _ in range(50):
            sigma, powers = np.exp(z), [np.exp(a * z) for a in loop.alpha]
            step = determinant(matrix_entries(loop, sigma, powers))
            step = step / (sigma * determinant_slope(loop, sigma, powers))
            step = np.where(np.abs(step) > 0.5, 0.5 * step / np.abs(step), step)
            z, last = z - step, step
    z = z[np.isfinite(z) & (np.abs(last) < 1e-9)]
    z = z[(z.imag > -1e-7) & (z.imag < np.pi - 1e-13)]
    found: list[complex] = []
    for candidate in z:
        if all(abs(candidate - known) > 1e-7 for known in found):
            found.append(complex(candidate))
    return np.exp(np.array(found))


def poles(loop: Loop) -> Complexes:
    """Return all principal-sheet poles in double precision, conjugates included, their number proved.

    Raises:
        ArithmeticError: Newton's method has not found as many poles as the argument principle counts.
    """
    if is_integer_order(loop):
        return np.linalg.eigvals(companion(loop)).astype(np.complex128)
    count = sheet_count(loop)
    for starts in (8, 16, 32, 64):
        upper = _newton(loop, starts)
        real = np.abs(upper.imag) < 1e-7 * np.abs(upper)
        found = np.concatenate([upper[real].real + 0j, upper[~real], upper[~real].conj()])
        if len(found) == count:
            return found
    raise ArithmeticError(f"{count} poles by the argument principle, {len(found)} by Newton's method")


def polished_poles(loop: Loop) -> list[Any]:
    """Return the poles of `poles` to the working precision of mpmath."""
    polished = []
    for start in poles(loop):
        sigma = mpmath.mpc(start)
        for _ in range(100):
            powers = [sigma ** mpmath.mpf(float(a)) for a in loop.alpha]
            step = determinant(matrix_entries(loop, sigma, powers)) / determinant_slope(loop, sigma, powers)
            sigma -= step
            if abs(step) < 100 * mpmath.eps * abs(sigma):
                break
        else:
            raise ArithmeticError(f"Newton's method does not settle at {start}: a double pole")
        polished.append(sigma)
    return polished
