"""Quadrature contours for the inverse Laplace transform on one window of time.

    f(t) = (1/2πi) ∫ e^{σt} F(σ) dσ,      σ(θ) = a + c - ν (cosh θ - 1) + i κ θ

Near θ = 0 the contour is a vertical line, so that it passes oscillatory poles at a constant distance; far out it
turns to the left exponentially fast. With ν small it is as flat-topped as the poles ask for, and the number of nodes
grows as ω t instead of (ω t)² for a hyperbola whose vertex rounding errors bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fracctl.arrays import Complexes, Floats
from fracctl.errors import UnsupportedError

ROUNDING = 1e-15
"""Rounding error of F that e^{c t} may amplify up to the tolerance."""
SMALLEST_RANGE = 7.0
"""Least bound on c that is allowed, whatever the tolerance."""


@dataclass(frozen=True)
class ContourShape:
    """A contour for times in [t₁/Λ, t₁], in units of 1/t₁, with the step of its quadrature rule."""

    vertex: float
    """c."""
    bend: float
    """ν."""
    speed: float
    """κ."""
    step: float
    """h, distance of nodes in θ."""
    nodes: int
    """N, nodes in the upper half plane."""

    def at(self, theta: Floats) -> tuple[Complexes, Complexes]:
        """Return σ - a and dσ/dθ, times t₁."""
        sigma, slope = np.empty(theta.shape, dtype=np.complex128), np.empty(theta.shape, dtype=np.complex128)
        sigma.real, sigma.imag = self.vertex - self.bend * (np.cosh(theta) - 1.0), self.speed * theta
        slope.real, slope.imag = -self.bend * np.sinh(theta), self.speed
        return sigma, slope


@lru_cache(maxsize=512)
def design(tolerance: float, ratio: float, height: float) -> ContourShape:
    """Return the contour with the fewest nodes for a half strip of poles.

    The singularities are the cut (-∞, 0] and poles with Re σ ≤ 0, |Im σ| t₁ ≤ `height`. A strip of analyticity
    of half-width y around the real θ-axis gives a midpoint rule of step h an error e^{-2πy/h}; upwards y ends at
    the cut and the poles, downwards the growth of e^{σt} limits it. The sum is cut off where e^{σ t₁/Λ} falls
    below the tolerance, and c is bounded so that rounding stays below it. The search is a mesh over (c, ν, y, κ).

    Args:
        tolerance: error of the quadrature relative to the largest value of the function.
        ratio: Λ, last over first time of the window.
        height: largest imaginary part of the poles times the last time.

    Raises:
        UnsupportedError: no contour of the mesh is high enough.
    """
    decades = -np.log(tolerance)
    c = np.linspace(1.0, max(np.log(tolerance / ROUNDING), SMALLEST_RANGE), 10)[:, None, None, None]
    nu = np.geomspace(1e-3, 60.0, 20)[:, None, None]
    y = np.geomspace(0.005, 1.2, 22)[:, None]
    kappa = np.linspace(0.1, 1.0, 10) * (c + nu * (1.0 - np.cos(y))) / y
    middle, bend = c + nu - kappa * y, nu * np.cos(y)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        above_pole = np.arccosh(np.maximum(middle / bend, 1.0))
        covers = kappa * above_pole - nu * np.sin(y) * np.sinh(above_pole) >= height
        far = np.arccosh((middle + decades * ratio) / bend)
        clears_cut = kappa * far >= nu * np.sin(y) * np.sinh(far)
        step = np.minimum(2.0 * np.pi * y / decades, _downward_step(c, nu, kappa, decades))
        count = np.arccosh(1.0 + (c + decades * ratio) / nu) / step
        count = np.where(covers & clears_cut, count, np.inf)
    best = np.unravel_index(np.argmin(count), count.shape)
    if not np.isfinite(count[best]):
        raise too_many_oscillations(height)
    nodes = int(np.ceil(count[best]))
    vertex = float(c[best[0], 0, 0, 0])
    return ContourShape(vertex, float(nu[best[1], 0, 0]), float(kappa[best]), float(step[best]), nodes)


def too_many_oscillations(height: float) -> UnsupportedError:
    """Return the refusal of poles whose imaginary parts times the horizon reach `height`."""
    return UnsupportedError(
        f"imaginary parts of poles times the horizon reach {height:.3g} rad, too many oscillations for the contour"
        " solver; shorten the horizon or lower the gains"
    )


def _downward_step(c: Floats, nu: Floats, kappa: Floats, decades: float) -> Floats:
    """Return the largest step whose error from below the real axis, e^{max Re σ t - 2πy/h}, meets the tolerance."""
    steps = [2.0 * np.pi * y / (c + nu * (1.0 - np.cos(y)) + kappa * y + decades) for y in np.linspace(0.3, 1.5, 9)]
    largest: Floats = np.max(steps, axis=0)
    return largest
