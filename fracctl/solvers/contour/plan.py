"""Where the contour solver puts nodes: windows of time, their contours and their panels."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.panels import Panel, PanelGrid
from fracctl.solvers.contour.design import ContourShape, design, too_many_oscillations
from fracctl.solvers.sampling import FIRST_TIME, LOGARITHMIC_NODES, panel_nodes

RATIOS = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
"""Last over first time of a window; few values, so that few contours are designed."""
_CHECKED = 5
"""Times of a window at which the two rules are compared."""
_LONGEST = 36.0
"""Half-length of a panel times the largest frequency, beyond which a window is split."""
_LARGEST = 5e8
"""Bytes of e^{σt} on all windows; kernels take as many again for each derivative."""


@dataclass(frozen=True, eq=False)
class Window:
    """One contour and the grid nodes it serves.

    The path holds, in order along the contour, the trapezoid nodes (even places) and the midpoint nodes (odd places)
    of the same step, then a few more that lead out to where the characteristic matrix is close to the identity.
    """

    path: Complexes
    """σ, (2N + 1 + extra,)."""
    weights: Complexes
    """(h/π) dσ/dθ at the first 2N + 1 of them; half at θ = 0."""
    nodes: int
    """N, the number of midpoint nodes."""
    where: slice
    """Grid nodes of this window."""
    times: Floats
    """Their times, (t,)."""
    checked: Array
    """Which of these times compare the two rules."""

    last: Floats
    """From values at these times to the last three Chebyshev coefficients of each panel, (3 panels, t)."""

    @property
    def rows(self) -> int:
        """Number of values and last coefficients."""
        return len(self.times) + len(self.last)

    @cached_property
    def _exponentials(self) -> Complexes:
        """e^{σt} at the first 2N + 1 nodes, (t, 2N + 1)."""
        return np.exp(self.times[:, None] * self.path[: 2 * self.nodes + 1])

    def kernels(self, exponents: tuple[float, ...]) -> tuple[Floats, Floats]:
        """Return real matrices that take Z(σ), real parts first, to (σ^e Z)(t) for each exponent.

        From the odd nodes to rows, values followed by last coefficients, (E rows, 2N), and from the even nodes to
        values at the checked times, (E c, 2N + 2).
        """
        stop = 2 * self.nodes + 1
        factors = [np.exp(e * np.log(self.path[:stop])) * self.weights for e in exponents]
        main = [_real(self._exponentials[:, 1::2] * factor[1::2]) for factor in factors]
        other = [_real(self._exponentials[self.checked, ::2] * factor[::2]) for factor in factors]
        return np.concatenate([part for values in main for part in (values, self.last @ values)]), np.concatenate(other)


def _real(kernel: Complexes) -> Floats:
    """Return the real matrix whose product with real and imaginary parts is the imaginary part of that of `kernel`."""
    return np.concatenate([kernel.imag, kernel.real], axis=1)


@dataclass(frozen=True, eq=False)
class Plan:
    """Grid and windows for a horizon and a hull of poles."""

    grid: PanelGrid
    windows: tuple[Window, ...]
    series_order: float
    """Highest exponent of the power series that fills the first panel."""

    @property
    def nodes(self) -> int:
        """Nodes at which the transform is evaluated, all windows."""
        return len(self.path)

    @cached_property
    def path(self) -> Complexes:
        """The paths of all windows, one after the other."""
        return np.concatenate([window.path for window in self.windows])


@lru_cache(maxsize=64)
def make_plan(horizon: float, hull: float, radius: float, shift: float, tolerance: float, series_order: int) -> Plan:
    """Return the plan for poles with Re σ ≤ shift, |Im σ| ≤ hull, all within |σ| < radius.

    Args:
        horizon: last time S.
        hull: largest imaginary part that the contours are designed for.
        radius: a circle that holds all poles; sets where the power series ends.
        shift: a, bound on the real parts of poles in the right half plane, 0 for stable loops.
        tolerance: relative error of the quadrature.
        series_order: highest exponent of the power series near t = 0.

    Raises:
        UnsupportedError: the poles oscillate too often up to the horizon.
    """
    span = max(horizon * (radius + shift) / _series_reach(tolerance, series_order), 2.0)
    count = int(np.ceil(np.log(span) / np.log(RATIOS[-1])))
    ratio = next(r for r in RATIOS if r**count >= span)
    edges = horizon * ratio ** np.arange(-count, 1.0)
    edges[-1] = horizon
    panels = [Panel(horizon * FIRST_TIME, float(edges[0]), LOGARITHMIC_NODES, logarithmic=True)]
    groups = [_panels(float(a), float(b), hull, tolerance) for a, b in itertools.pairwise(edges)]
    grid = PanelGrid([*panels, *(panel for group in groups for panel in group)])
    ends = np.cumsum([1, *(len(group) for group in groups)])
    places = [slice(int(grid.offsets[a]), int(grid.offsets[b])) for a, b in itertools.pairwise(ends)]
    shapes = [design(tolerance, ratio, _rounded_up(hull * group[-1].end)) for group in reversed(groups)][::-1]
    size = sum(32.0 * shape.nodes * (where.stop - where.start) for shape, where in zip(shapes, places, strict=True))
    if size > _LARGEST:
        raise too_many_oscillations(hull * horizon)
    windows = [_window(shape, where, grid, radius, shift) for shape, where in zip(shapes, places, strict=True)]
    return Plan(grid, tuple(windows), float(series_order))


def _series_reach(tolerance: float, order: int) -> float:
    """Return the time, times the pole radius R, up to which the series and its first derivative keep the tolerance.

    Coefficients are of the size R^e, so that the omitted part of the derivative is (R t)^(n-1) / (n-1)! for order n.
    """
    return float((math.factorial(order - 1) * tolerance) ** (1.0 / (order - 1)))


def _rounded_up(height: float) -> float:
    """Round to the next power of 1.1, so that few different contours are designed."""
    return float(1.1 ** np.ceil(np.log(height) / np.log(1.1)))


def _panels(start: float, end: float, hull: float, tolerance: float) -> list[Panel]:
    """Split a window so that panels of polynomials resolve both the powers of time at 0 and the oscillation."""
    count = int(np.ceil(0.5 * hull * (end - start) / _LONGEST))
    edges = np.linspace(start, end, max(count, 1) + 1)
    return [
        Panel(float(a), float(b), panel_nodes(float(b / a), 0.5 * hull * float(b - a), tolerance))
        for a, b in itertools.pairwise(edges)
    ]


def _window(shape: ContourShape, where: slice, grid: PanelGrid, radius: float, shift: float) -> Window:
    last = 2 * shape.nodes + 1
    half = 0.5 * shape.step
    times = grid.times[where]
    end = float(times[-1])
    theta = half * np.arange(last)
    far = np.arccosh(1.0 + (shape.vertex + 2.5 * (radius + shift) * end) / shape.bend)
    beyond = np.arange(theta[-1] + 2.0 * half, max(far, theta[-1]) + 2.0 * half, 2.0 * half)
    sigma, slope = shape.at(np.concatenate([theta, beyond]))
    weights = (shape.step / np.pi) * slope[:last] / end
    weights[0] *= 0.5
    checked = np.linspace(0, len(times) - 1, _CHECKED).astype(int)
    return Window(shift + sigma / end, weights, shape.nodes, where, times, checked, last_coefficients(grid, where))


def last_coefficients(grid: PanelGrid, where: slice) -> Floats:
    """Return the matrix from values on some panels to the last three Chebyshev coefficients of each, (3 panels, t)."""
    mine = [(a, b) for a, b in itertools.pairwise(grid.offsets) if where.start <= a < where.stop]
    matrix = np.zeros((3 * len(mine), where.stop - where.start))
    for i, (a, b) in enumerate(mine):
        matrix[3 * i : 3 * i + 3, a - where.start : b - where.start] = grid.last[:, a:b]
    return matrix
