"""Trajectories on uniform samples of time, as printed tables are often computed from them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.fractional.barycentric import interpolation
from fracctl.panels import PanelGrid
from fracctl.polynomials import comparing, over_rows

MOST_SAMPLES = 1_000_000
"""More samples than this up to the horizon are a misprint of the resolution."""

_VALUES_IN_CHUNK = 2**18
"""Samples of all members that are held at once; 2 MB stay in the processor's cache."""

_MOST_SHARED = 20_000
"""Samples whose matrices are kept for other trajectories on the same panels; they take some 5 MB a grid."""


def samples_of(grid: PanelGrid, resolution: float) -> Samples:
    """Return the samples of a grid, made once for groups of trajectories on the same panels; see `Samples`."""
    few = grid.horizon <= _MOST_SHARED * resolution
    return _shared(grid, resolution) if few else Samples(grid, resolution)


@lru_cache(maxsize=16)
def _shared(grid: PanelGrid, resolution: float) -> Samples:
    return Samples(grid, resolution)


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
        """Yield the samples of some members at a time: which members, and their samples (r, t), until the next.

        Args:
            values: at the nodes of the grid, (b, T).
            initial: at time 0, (b,).
        """
        size = max(1, _VALUES_IN_CHUNK // len(self.times))
        room = np.empty((min(size, len(values)), len(self.times)))
        for start in range(0, len(values), size):
            members = slice(start, min(start + size, len(values)))
            samples = room[: members.stop - start]
            for nodes, where, matrix in self._parts:
                np.matmul(values[members, nodes], matrix, out=samples[:, where])
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
            above, below = samples.max(axis=1), -samples.min(axis=1)
            tops = np.where(side[members] == 0.0, np.maximum(above, below), np.where(side[members] > 0.0, above, below))
            largest[members] = np.maximum(tops, 0.0)
        return largest

    def largest_extremum(self, values: Floats, initial: Floats) -> Floats:
        """Return the largest |sample| that lies above or below both its neighbours, 0 if there is none, as (b,)."""
        largest = np.zeros(len(values))
        for members, samples in self.of(values, initial):
            largest[members] = _largest_turns(samples)
        return largest


@over_rows
def _largest_turns(samples: Floats) -> Floats:
    """Largest |sample| of each row between a rise and a fall."""
    largest = np.empty(len(samples))
    for i in range(len(samples)):
        largest[i] = _largest_turn(samples[i])
    return largest


@comparing
def _largest_turn(row: Floats) -> float:
    """Largest |sample| of a row between a rise and a fall, 0 if there is none."""
    largest, one = 0.0, np.uint64(1)
    for j in range(one, np.uint64(max(len(row) - 1, 1))):
        here = row[j]
        height = abs(here) if (here - row[j - one]) * (row[j + one] - here) <= 0.0 else 0.0
        largest = height if height > largest else largest
    return largest
