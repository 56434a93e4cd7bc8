"""Reference measures, from the reference trajectory's own roots, extrema and exact integrals.

settling time    the last s in (0, S] with |x_i| = δ for some component i; inf where |x_i(S)| ≥ δ, 0 where never above
sampled          the last multiple of `resolution` up to S at which |x_i| > δ
overshoot        1 + c · mean over i of the largest excursion. `past_equilibrium`: on the side opposite to x_i(0), on
                 either side where x_i(0) = 0. `largest_extremum`: the largest |x_i| at an interior extremum
control effort   Σ_i ∫₀ˢ |υ_i| ds = Σ_i Σ |V_i(z_{k+1}) - V_i(z_k)| with V = ∫υ by its own transform, z the zeros of υ_i

Origin: spec of the project, from Yaylali, Butcher, Sinclair. Roots are bracketed on a grid that is graded towards 0,
where υ ~ s^(1-α), and polished by Brent's method to 1e-14. Tolerance: 1e-10 relative, but for tangential crossings.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tests.references.laplace import QuickReference, Reference

Floats = NDArray[np.float64]


def scan_grid(horizon: float, count: int = 2000) -> Floats:
    """Return times graded from 1e-9 up, then uniform up to `horizon`."""
    return np.unique(np.concatenate([np.geomspace(1e-9, 0.05, 200), np.linspace(0.05, horizon, count)]))


def roots(function: Callable[[Floats], Floats], grid: Floats) -> Floats:
    """Return the sign changes of a scalar function that the grid brackets."""
    values = function(grid)
    where = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
    polished = [brentq(lambda s: float(function(np.array([s]))[0]), *grid[k : k + 2], xtol=1e-14) for k in where]
    return np.array(polished)


class ReferenceMeasures:
    """Measures of one reference trajectory on [0, horizon]."""

    def __init__(self, reference: Reference | QuickReference, horizon: float) -> None:
        self.reference, self.horizon = reference, horizon
        self.grid = scan_grid(horizon)
        self.values = reference(self.grid)

    def _component(self, name: str, i: int) -> Callable[[Floats], Floats]:
        return lambda s: np.asarray(getattr(self.reference(s), name)[:, i])

    def settling_time(self, threshold: float = 1e-5) -> float:
        """Return the last crossing of |x| = threshold."""
        if np.max(np.abs(self.values.position[-1])) >= threshold:
            return np.inf
        last = 0.0
        for i in range(self.reference.loop.size):
            position = self._component("position", i)
            outside = np.flatnonzero(np.abs(self.values.position[:, i]) > threshold)
            if outside.size:
                first, second = self.grid[outside[-1]], self.grid[outside[-1] + 1]
                crossing = roots(lambda s, x=position: np.abs(x(s)) - threshold, np.array([first, second]))
                last = max(last, float(crossing[-1]))
        return last

    def sampled_settling_time(self, threshold: float = 1e-5, resolution: float = 0.01) -> float:
        """Return the last sample outside the band."""
        samples = resolution * np.arange(1, int(self.horizon / resolution) + 1)
        outside = np.flatnonzero(np.max(np.abs(self.reference(samples).position), axis=1) > threshold)
        if not outside.size:
            return 0.0
        return np.inf if outside[-1] == samples.size - 1 else float(samples[outside[-1]])

    def extrema(self, i: int) -> Floats:
        """Return x_i at its interior extrema."""
        times = roots(self._component("rate", i), self.grid)
        return self.reference(times).position[:, i] if times.size else np.zeros(0)

    def overshoot(self, definition: str = "past_equilibrium", scale: float = 1e4) -> float:
        """Return 1 + scale · the mean of the components' largest excursions."""
        excursions = []
        for i in range(self.reference.loop.size):
            extrema = self.extrema(i)
            if definition == "largest_extremum":
                excursions.append(np.max(np.abs(extrema), initial=0.0))
                continue
            side = np.sign(self.reference.loop.value[i])
            reached = np.append(extrema, self.values.position[-1, i])
            past = np.abs(reached) if side == 0 else -side * reached
            excursions.append(np.max(past, initial=0.0))
        return 1.0 + scale * float(np.mean(excursions))

    def control_effort(self, horizon: float | None = None) -> float:
        """Return Σ ∫ |υ|."""
        end = self.horizon if horizon is None else horizon
        total = 0.0
        for i in range(self.reference.loop.size):
            zeros = roots(self._component("control", i), self.grid if end == self.horizon else scan_grid(end))
            ends = np.concatenate([[0.0], zeros, [end]])
            total += float(np.abs(np.diff(self.reference(ends).impulse[:, i])).sum())
        return total
