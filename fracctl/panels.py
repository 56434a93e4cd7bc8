"""Functions of time on Chebyshev panels: interpolation, slopes and integrals for whole batches.

A panel is an interval of time with n Chebyshev-Lobatto nodes in a variable y in [-1, 1]; time is linear in y, or
its logarithm is (the first panel, where solutions behave as powers of time). Values have the nodes of all panels as
their last axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.fractional.barycentric import interpolation, lobatto_weights


@dataclass(frozen=True)
class Panel:
    """One interval of time."""

    start: float
    end: float
    nodes: int
    """Number n of Chebyshev-Lobatto nodes, both ends included."""
    logarithmic: bool = False
    """Whether ln t instead of t is linear in y."""

    def time(self, y: Floats) -> Floats:
        """Return time at y."""
        times: Floats
        if self.logarithmic:
            times = self.start * (self.end / self.start) ** (0.5 * (y + 1.0))
        else:
            times = self.start + 0.5 * (self.end - self.start) * (y + 1.0)
        return times

    def y(self, time: Floats) -> Floats:
        """Return y at times of this panel."""
        y: Floats
        if self.logarithmic:
            y = 2.0 * np.log(time / self.start) / np.log(self.end / self.start) - 1.0
        else:
            y = 2.0 * (time - self.start) / (self.end - self.start) - 1.0
        return y

    def rate(self, y: Floats) -> Floats:
        """Return dt/dy at y."""
        if self.logarithmic:
            rate: Floats = 0.5 * np.log(self.end / self.start) * self.time(y)
            return rate
        return np.full_like(y, 0.5 * (self.end - self.start))


@dataclass(frozen=True)
class _Rule:
    """Matrices of n Chebyshev-Lobatto nodes in y."""

    y: Floats
    weights: Floats
    """Barycentric weights, (n,)."""
    slope: Floats
    """d/dy at the nodes, (n, n), to be applied from the right."""
    integral: Floats
    """Integrals from -1 to the nodes, (n, n), from the right."""
    last: Floats
    """The last three Chebyshev coefficients, (n, 3), from the right."""


@lru_cache(maxsize=256)
def _rule(n: int) -> _Rule:
    k = np.arange(n)
    y = np.sin(0.5 * np.pi * (2.0 * k - (n - 1)) / (n - 1))
    weights = lobatto_weights(n)
    gap = y[:, None] - y + np.eye(n)
    slope = (weights / weights[:, None]) / gap
    slope -= np.diag(slope.sum(axis=1))
    x, w = np.polynomial.legendre.leggauss(n // 2 + 1)
    half = 0.5 * np.diff(y)
    points = y[:-1, None] + half[:, None] * (x + 1.0)
    basis = interpolation(y, weights, points.ravel()).reshape(n - 1, len(x), n)
    pieces = np.einsum("j,g,jgi->ij", half, w, basis)
    integral = np.concatenate([np.zeros((n, 1)), np.cumsum(pieces, axis=1)], axis=1)
    degrees = np.arange(n - 3, n)
    cosines = np.cos(degrees * np.pi * (n - 1 - k)[:, None] / (n - 1))
    scale = np.where(degrees == n - 1, 1.0, 2.0) / (n - 1)
    last = cosines * scale * np.where((k == 0) | (k == n - 1), 0.5, 1.0)[:, None]
    return _Rule(y, weights, np.ascontiguousarray(slope.T), integral, last)


class PanelGrid:
    """The nodes of consecutive panels, and what can be done with values on them.

    Args:
        panels: at least one, each beginning where its predecessor ends.
    """

    def __init__(self, panels: Sequence[Panel]) -> None:
        self.panels = tuple(panels)
        self.rules = [_rule(panel.nodes) for panel in self.panels]
        self.offsets = np.concatenate([[0], np.cumsum([panel.nodes for panel in self.panels])])
        pairs = list(zip(self.panels, self.rules, strict=True))
        self.y: Floats = np.concatenate([rule.y for rule in self.rules])
        self.last: Floats = np.ascontiguousarray(np.concatenate([rule.last for rule in self.rules]).T)
        self.weights: Floats = np.concatenate([rule.weights for rule in self.rules])
        self.times: Floats = np.concatenate([panel.time(rule.y) for panel, rule in pairs])
        self.rates: Floats = np.concatenate([panel.rate(rule.y) for panel, rule in pairs])
        for i, panel in enumerate(self.panels):
            self.times[self.offsets[i]], self.times[self.offsets[i + 1] - 1] = panel.start, panel.end

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PanelGrid) and self.panels == other.panels

    def __hash__(self) -> int:
        return hash(self.panels)

    @cached_property
    def nodes(self) -> Floats:
        """y and barycentric weights, (2, T)."""
        return np.stack([self.y, self.weights])

    @cached_property
    def slopes(self) -> Floats:
        """Rows that take the values of a panel, in their first columns, to d/dy at its nodes, (T, n)."""
        return self._rows([rule.slope for rule in self.rules])

    @cached_property
    def integrals(self) -> Floats:
        """Rows that take the values of a panel to their integrals over time from its start to its nodes, (T, n)."""
        return self._rows([self.rates[where, None] * rule.integral for where, _, rule in self.slices()])

    @cached_property
    def clock(self) -> Floats:
        """Start, dt/dy or, of logarithmic panels, d ln t/dy, and 1 for those and 0 for linear ones, (P, 3)."""
        spans = [np.log(p.end / p.start) if p.logarithmic else p.end - p.start for p in self.panels]
        return np.array([(p.start, 0.5 * span, p.logarithmic) for p, span in zip(self.panels, spans, strict=True)])

    def _rows(self, matrices: list[Floats]) -> Floats:
        """Matrices to be applied from the right, one a panel, as the rows of their columns."""
        rows = np.zeros((len(self.y), max(panel.nodes for panel in self.panels)))
        for (where, panel, _), matrix in zip(self.slices(), matrices, strict=True):
            rows[where, : panel.nodes] = matrix.T
        return rows

    @property
    def horizon(self) -> float:
        """The end of the last panel."""
        return self.panels[-1].end

    def slices(self) -> Iterator[tuple[slice, Panel, _Rule]]:
        """Yield where in the node axis each panel stands, the panel and its rule."""
        for i, (panel, rule) in enumerate(zip(self.panels, self.rules, strict=True)):
            yield slice(int(self.offsets[i]), int(self.offsets[i + 1])), panel, rule

    def derivative(self, values: Floats) -> Floats:
        """Return d/dt of values (…, T) at the nodes."""
        out = np.empty_like(values)
        for where, _, rule in self.slices():
            out[..., where] = values[..., where] @ rule.slope
        return out / self.rates

    def evaluate(self, values: Floats, times: Floats) -> Floats:
        """Return values (…, T) interpolated at times (t,); before the first node the first value."""
        out = np.empty((*values.shape[:-1], len(times)))
        panels, y = self.locate(times)
        for i, (where, _, rule) in enumerate(self.slices()):
            mine = panels == i
            if mine.any():
                out[..., mine] = values[..., where] @ interpolation(rule.y, rule.weights, y[mine]).T
        return out

    def locate(self, times: Floats) -> tuple[Array, Floats]:
        """Return panel and y of times (r,); times before the first panel are moved to its start."""
        starts = np.array([panel.start for panel in self.panels])
        panels = np.clip(np.searchsorted(starts, times, side="right") - 1, 0, len(starts) - 1)
        y = np.empty(len(times))
        for i, panel in enumerate(self.panels):
            mine = panels == i
            y[mine] = np.clip(panel.y(np.maximum(times[mine], panel.start)), -1.0, 1.0)
        return panels, y
