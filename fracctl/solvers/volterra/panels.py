"""Panels of equal length with the matrices of fractional integrals from 0 on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from fracctl.arrays import Floats
from fracctl.fractional.collocation import chebyshev_nodes, integral_matrix, memory_matrix
from fracctl.panels import Panel, PanelGrid
from fracctl.solvers.sampling import FIRST_TIME, graded_panels

_ACCURACY = 1e-11
"""Of the grid on which the first panel is handed out."""
_SHORT_TIME = 0.0004
"""End of the first, logarithmic panel of that grid over the length of a panel."""


@dataclass(frozen=True)
class UniformPanels:
    """`count` panels of [0, S] with N Chebyshev-Gauss-Lobatto nodes each.

    A function is known by its values on the nodes of all panels, (…, count, N). It is handed out at 0, on a graded
    grid on the first panel, where it has powers of time, and at the nodes of the others: the sampling times.
    """

    horizon: float
    count: int
    nodes: int
    """N."""
    sampled: int = 0
    """Nodes of a panel at the sampling times; 0 for N."""

    def coarser(self) -> UniformPanels:
        """Return the panels with 7/8 of the nodes, with the same sampling times."""
        return replace(self, nodes=self.nodes - max(self.nodes // 8, 1), sampled=self.sampled or self.nodes)

    @property
    def length(self) -> float:
        """Length of a panel."""
        return self.horizon / self.count

    @property
    def first_times(self) -> Floats:
        """Nodes of the first panel, (N,)."""
        return chebyshev_nodes(self.nodes).t * self.length

    @cached_property
    def later_times(self) -> Floats:
        """Nodes of the other panels, (count - 1, N)."""
        return (np.arange(1, self.count)[:, None] + chebyshev_nodes(self.nodes).t) * self.length

    @property
    def grid(self) -> PanelGrid:
        """The sampling times but 0, as a grid."""
        return _grid(self.horizon, self.count, self.sampled or self.nodes)

    @property
    def start(self) -> Floats:
        """The sampling times on the first panel, 0 among them, (T,)."""
        grid = self.grid
        later = (self.count - 1) * (self.sampled or self.nodes)
        return np.concatenate([[0.0], grid.times[: len(grid.times) - later]])

    def local(self, order: float) -> Floats:
        """Return the matrix of I^order from the start of a panel to its nodes, (N, N), from the left."""
        matrix: Floats = integral_matrix(self.nodes, order) * self.length**order
        return matrix

    def memory(self, order: float, values: Floats) -> Floats:
        """Return what the panels of `values` (…, q, N) add to I^order on the next panel, (…, N)."""
        flat = values.reshape(*values.shape[:-2], -1)
        added: Floats = flat @ _memory(self.nodes, order, self.count)[-flat.shape[-1] :] * self.length**order
        return added

    def on_start(self, order: float, values: Floats) -> Floats:
        """Return I^order of `values` (…, N) on the first panel at its sampling times, (…, T)."""
        points = self.start / self.length
        sampled: Floats = values @ _start_matrix(self.nodes, order, points.tobytes()) * self.length**order
        return sampled

    def resampled(self, values: Floats) -> Floats:
        """Return values (…, q, N) at the nodes of the other panels at their sampling times, (…, q · sampled)."""
        if self.sampled not in (0, self.nodes):
            values = values @ chebyshev_nodes(self.nodes).interpolation(chebyshev_nodes(self.sampled).t).T
        flat: Floats = values.reshape(*values.shape[:-2], -1)
        return flat


@lru_cache(maxsize=32)
def _memory(n: int, order: float, count: int) -> Floats:
    """Return what all panels before the last add to it, (n (count - 1), n), the first on top, from the right."""
    return np.concatenate([memory_matrix(n, order, distance).T for distance in range(count - 1, 0, -1)])


@lru_cache(maxsize=64)
def _start_matrix(n: int, order: float, points: bytes) -> Floats:
    return np.ascontiguousarray(integral_matrix(n, order, np.frombuffer(points)).T)


@lru_cache(maxsize=64)
def _grid(horizon: float, count: int, nodes: int) -> PanelGrid:
    length = horizon / count

    def waves(start: float, end: float) -> float:
        return 0.5 * nodes * (end - start) / length

    first = graded_panels(FIRST_TIME * horizon, _SHORT_TIME * length, length, waves, _ACCURACY)
    others = [Panel(q * length, (q + 1) * length, nodes) for q in range(1, count)]
    return PanelGrid([*first, *others])
