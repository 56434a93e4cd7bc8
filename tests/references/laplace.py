"""Reference trajectories: numerical inverse Laplace transform with the poles taken out, to any number of digits.

    M(σ) R = σ ξ₀' + (S - K_P) ξ₀,    Ξ = (R + ξ₀)/σ,    Υ = -K_P Ξ - K_D diag(σ^(α-1)) R

R is the transform of ξ', in which no initial value cancels for large σ. Principal-sheet poles p and residues c are
known (`tests.references.poles`, their number proved), so the transform Ξ - Σ c/(σ - p) is analytic off the cut; it is
inverted by the midpoint rule on the hyperbola σ = μ (1 + sin(iu - φ)), μ = κ/T, which depends on the time window
[T/4, T] alone, and Σ c e^(p t) is added. No contour has to enclose a pole, so none can be wrong. The integral ∫₀ˢ υ
has the transform Υ/σ.

Origin: Weideman and Trefethen, Math. Comp. 76 (2007) 1341, for the hyperbola; node spacing and range here follow from
the strip of analyticity |φ| < π/4 and the wanted digits, not from their optimum. Tolerance: 10^-digits of the peak.
Checked against power series, mpmath's de Hoog and Talbot inversions and matrix exponentials in
tests/references/test_references.py.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.references import poles
from tests.references.loops import Floats, Loop

WINDOW = 4
GUARD = 12
"""Digits carried beyond those asked for: nodes near poles, near-double poles."""


@dataclass(frozen=True)
class Contour:
    """Midpoint nodes in the upper half plane for the times [T/4, T]."""

    sigma: tuple[Any, ...]
    log_sigma: tuple[Any, ...]
    weights: tuple[Any, ...]
    """h/π · dσ/du, so that f(t) = Im Σ weight · e^(σt) · F(σ)."""


@functools.lru_cache(maxsize=256)
def contour(window: int, digits: int) -> Contour:
    """Return the nodes for T = 4^window."""
    with mpmath.workdps(digits + GUARD):
        accuracy = math.log(10.0) * (digits + 3)
        kappa = accuracy / 4.0
        spacing = 2.0 * math.pi * 0.95 * (math.pi / 4.0) / (accuracy + kappa)
        reach = math.acosh((1.0 + WINDOW * accuracy / kappa) * math.sqrt(2.0))
        mu, h = mpmath.mpf(kappa) / mpmath.mpf(WINDOW) ** window, mpmath.mpf(spacing)
        argument = [mpmath.mpc(-mpmath.pi / 4, (k + 0.5) * h) for k in range(math.ceil(reach / spacing))]
        sigma = [mu * (1 + mpmath.sin(z)) for z in argument]
        weights = [h / mpmath.pi * mu * 1j * mpmath.cos(z) for z in argument]
        return Contour(tuple(sigma), tuple(mpmath.log(s) for s in sigma), tuple(weights))


def _solve(entries: list[list[Any]], right: Sequence[Any]) -> tuple[list[Any], Any]:
    """Return adj(M) right and det M."""
    if len(right) == 1:
        return [right[0]], entries[0][0]
    (a, b), (c, d) = entries
    return [d * right[0] - b * right[1], a * right[1] - c * right[0]], a * d - b * c


def _right_hand_side(loop: Loop, sigma: Any) -> list[Any]:
    """Return σ ξ₀' + (S - K_P) ξ₀."""
    m = range(loop.size)
    value, rate = [float(x) for x in loop.value], [float(x) for x in loop.rate]
    stiffness, k_p = loop.stiffness.tolist(), loop.k_p.tolist()
    one = sigma / sigma
    return [sigma * rate[i] + sum((one * stiffness[i][j] - k_p[i][j]) * value[j] for j in m) for i in m]


def _from_rate(loop: Loop, sigma: Any, powers: list[Any], rate: list[Any], value: list[float]) -> list[Any]:
    """Return Ξ, R, Υ, Υ/σ for R and ξ₀ (or, for residues, 0 in its place)."""
    m = range(loop.size)
    k_p, k_d = loop.k_p.tolist(), loop.k_d.tolist()
    position = [(rate[i] + value[i]) / sigma for i in m]
    control = [-sum(k_p[i][j] * position[j] + k_d[i][j] * (powers[j] / sigma) * rate[j] for j in m) for i in m]
    return [*position, *rate, *control, *[x / sigma for x in control]]


def transforms(loop: Loop, sigma: Any, powers: list[Any]) -> list[Any]:
    """Return the transforms of ξ, ξ', υ, ∫υ (4m of them) at σ; a mpmath number or an array of nodes."""
    numerator, det = _solve(poles.matrix_entries(loop, sigma, powers), _right_hand_side(loop, sigma))
    return _from_rate(loop, sigma, powers, [x / det for x in numerator], loop.value.tolist())


def residues(loop: Loop, pole: Any, powers: list[Any]) -> list[Any]:
    """Return the residues of `transforms` at a simple pole."""
    numerator, _ = _solve(poles.matrix_entries(loop, pole, powers), _right_hand_side(loop, pole))
    slope = poles.determinant_slope(loop, pole, powers)
    return _from_rate(loop, pole, powers, [x / slope for x in numerator], [0.0] * loop.size)


def window_of(time: float) -> int:
    """Return the window j with 4^(j-1) < time ≤ 4^j."""
    return math.ceil(math.log(time, WINDOW) - 1e-12)


def _by_window(times: Floats) -> Iterator[tuple[int | None, NDArray[np.intp]]]:
    """Yield each window and the places of its times; None for the time 0."""
    windows = [window_of(t) if t > 0 else None for t in times]
    for window in set(windows):
        yield window, np.flatnonzero([w == window for w in windows])


@dataclass(frozen=True)
class Values:
    """A trajectory at some times; every array is (t, m)."""

    position: Any
    rate: Any
    control: Any
    impulse: Any
    """∫₀ˢ υ."""

    @property
    def states(self) -> Any:
        """[ξ, ξ'], (t, 2m)."""
        return np.hstack([self.position, self.rate])


class Reference:
    """The trajectory of a loop with simple poles, to `digits` digits by `at` and in double precision by calling it."""

    def __init__(self, loop: Loop, digits: int = 20) -> None:
        self.loop, self.digits = loop, digits
        with mpmath.workdps(digits + GUARD):
            self.poles = poles.polished_poles(loop)
            self.residues = [residues(loop, p, self._powers(mpmath.log(p))) for p in self.poles]
        self._nodes: dict[tuple[int, int], list[list[Any]]] = {}

    @property
    def stable(self) -> bool:
        """Whether all principal-sheet poles lie in the left half plane."""
        return all(p.real < 0 for p in self.poles)

    def _powers(self, log_sigma: Any) -> list[Any]:
        return [mpmath.exp(float(a) * log_sigma) for a in self.loop.alpha]

    def _weighted(self, window: int, digits: int) -> list[list[Any]]:
        """Return weight · (F - Σ c/(σ - p)) at each node, (nodes, 4m)."""
        if (window, digits) not in self._nodes:
            nodes = contour(window, digits)
            rows = []
            for sigma, log_sigma, weight in zip(nodes.sigma, nodes.log_sigma, nodes.weights, strict=True):
                values = transforms(self.loop, sigma, self._powers(log_sigma))
                for pole, residue in zip(self.poles, self.residues, strict=True):
                    factor = 1 / (sigma - pole)
                    values = [v - c * factor for v, c in zip(values, residue, strict=True)]
                rows.append([weight * v for v in values])
            self._nodes[window, digits] = rows
        return self._nodes[window, digits]

    def at(self, time: Any) -> list[Any]:
        """Return ξ, ξ', υ, ∫υ at one time > 0 as 4m mpmath numbers, right to `digits` digits of the peak."""
        window = window_of(float(time))
        with mpmath.workdps(self.digits + GUARD):
            time = mpmath.mpf(time)
            rows = self._weighted(window, self.digits)
            factors = [mpmath.exp(s * time) for s in contour(window, self.digits).sigma]
            values = [mpmath.fdot(factors, column).imag for column in zip(*rows, strict=True)]
            for pole, residue in zip(self.poles, self.residues, strict=True):
                factor = mpmath.exp(pole * time)
                values = [v + (c * factor).real for v, c in zip(values, residue, strict=True)]
            return values

    def digits_at(self, times: ArrayLike) -> Values:
        """Return the values of `at`, computed in `digits` digits and rounded to doubles."""
        table = np.array([[float(x) for x in self.at(t)] for t in np.asarray(times, float).ravel()])
        return Values(*np.split(table, 4, axis=1))

    def __call__(self, times: ArrayLike) -> Values:
        """Return the values in double precision, to about 1e-13 of the peak; fast for many times ≥ 0."""
        times = np.asarray(times, float).ravel()
        table = np.empty((times.size, 4 * self.loop.size))
        pole, residue = np.array(self.poles, complex), np.array(self.residues, complex)
        for window, rows in _by_window(times):
            if window is None:
                table[rows] = _initial(self.loop)
                continue
            with mpmath.workdps(self.digits + GUARD):
                values = np.array([[complex(v) for v in row] for row in self._weighted(window, 15)])
            sigma = np.array([complex(s) for s in contour(window, 15).sigma])
            table[rows] = (np.exp(np.outer(times[rows], sigma)) @ values).imag
            table[rows] += (np.exp(np.outer(times[rows], pole)) @ residue).real
        return Values(*np.split(table, 4, axis=1))


def _initial(loop: Loop) -> Floats:
    """Return ξ, ξ', υ, ∫υ at s = 0, where the Caputo derivative is 0 for orders below 1."""
    control = -loop.k_p @ loop.value - loop.k_d @ np.where(loop.alpha == 1.0, loop.rate, 0.0)
    return np.concatenate([loop.value, loop.rate, control, np.zeros(loop.size)])


class QuickReference:
    """The same in double precision throughout: about 1e-11 of the peak at simple poles, within milliseconds.

    For tests over many loops; checked against `Reference` in tests/references/test_references.py.
    """

    def __init__(self, loop: Loop) -> None:
        self.loop, self.poles = loop, poles.poles(loop)
        pairs = zip(self.poles, np.log(self.poles), strict=True)
        self.residues = np.array([residues(loop, p, [np.exp(a * z) for a in loop.alpha]) for p, z in pairs])

    def __call__(self, times: ArrayLike) -> Values:
        """Return the values at times ≥ 0."""
        times = np.asarray(times, float).ravel()
        table = (np.exp(np.outer(times, self.poles)) @ self.residues).real
        for window, rows in _by_window(times):
            if window is None:
                table[rows] = _initial(self.loop)
                continue
            sigma, log_sigma, weights = _double_contour(window)
            powers = [np.exp(a * log_sigma) for a in self.loop.alpha]
            smooth = np.array(transforms(self.loop, sigma, powers)).T
            smooth = smooth - (1.0 / (sigma[:, None] - self.poles)) @ self.residues
            table[rows] += (np.exp(np.outer(times[rows], sigma)) @ (weights[:, None] * smooth)).imag
        return Values(*np.split(table, 4, axis=1))


@functools.lru_cache(maxsize=64)
def _double_contour(window: int) -> tuple[NDArray[np.complex128], ...]:
    nodes = contour(window, 14)
    return tuple(np.array([complex(x) for x in part]) for part in (nodes.sigma, nodes.log_sigma, nodes.weights))
