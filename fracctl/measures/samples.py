"""Trajectories on uniform samples of time, as printed tables are often computed from them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.panels import PanelGrid, interpolation

MOST_SAMPLES = 1_000_000
"""More samples than this up to the horizon are a misprint of the resolution."""

_VALUES_IN_CHUNK = 2**18
"""Samples of all members that are held at once; 2 MB stay in the processor's cache."""


class Samples:
    """The samples 0, resolution, 2 resolution, … up to the horizon of a grid.

    Args:
        grid: panels that cover (0, horizon].
        resolution: step in time, positive.

    Raises:
        ArgumentError: there are more than `MOST_SAMPLES`.
    """

    def __init__(self, grid: PanelGrid, resolution: float) -> None:
        count = int(np.floor(grid.horizon / resolution * (1.0 + 1e-14))) + 1
        if count > MOST_SAMPLES:
            raise ArgumentError(
                "resolution", resolution, f"must leave at most {MOST_SAMPLES} samples up to the horizon"
            )
        self.resolution = resolution
        self.times: Floats = np.arange(count, dtype=np.float64) * resolution
        panels, y = grid.locate(self.times)
        self._parts = []
        for i, (nodes, _, rule) in enumerate(grid.slices()):
            first, stop = np.searchsorted(panels, [i, i + 1])
            if first < stop:
                matrix = np.ascontiguousarray(interpolation(rule.y, rule.weights, y[first:stop]).T)
                self._parts.append((nodes, slice(int(first), int(stop)), matrix))

    def of(self, values: Floats, initial: Floats) -> Iterator[tuple[slice, Floats]]:
        """Yield the samples of some members at a time: which members, and their samples (r, t).

        Args:
            values: at the nodes of the grid, (b, T).
            initial: at time 0, (b,).
        """
        size = max(1, _VALUES_IN_CHUNK // len(self.times))
        for start in range(0, len(values), size):
            members = slice(start, min(start + size, len(values)))
            samples = np.empty((members.stop - start, len(self.times)))
            for nodes, where, matrix in self._parts:
                samples[:, where] = values[members, nodes] @ matrix
            samples[:, 0] = initial[members]
            yield members, samples

    def absolute_integral(self, values: Floats, initial: Floats) -> Floats:
        """Return ∫ |values| by the trapezoidal rule, (b,)."""
        weights = np.full(len(self.times), self.resolution)
        weights[[0, -1]] *= 0.5
        total = np.empty(len(values))
        for members, samples in self.of(values, initial):
            total[members] = np.abs(samples, out=samples) @ weights
        return total if len(self.times) > 1 else np.zeros(len(values))

    def largest_excursion(self, values: Floats, initial: Floats, side: Floats) -> Floats:
        """Return the largest sample, at least 0, of side · values, or of ± values where side is 0, as (b,)."""
        largest = np.zeros(len(values))
        for members, samples in self.of(values, initial):
            for sign in (-1.0, 1.0):
                asked = np.flatnonzero(side[members] != -sign)
                tops = (sign * samples[asked]).max(axis=1)
                largest[members][asked] = np.maximum(largest[members][asked], tops)
        return largest

    def largest_extremum(self, values: Floats, initial: Floats) -> Floats:
        """Return the largest |sample| that lies above or below both its neighbours, 0 if there is none, as (b,)."""
        largest = np.zeros(len(values))
        for members, samples in self.of(values, initial):
            rises = np.diff(samples)
            turns = rises[:, :-1] * rises[:, 1:] <= 0.0
            largest[members] = np.max(np.abs(samples[:, 1:-1]), axis=1, where=turns, initial=0.0)
        return largest
