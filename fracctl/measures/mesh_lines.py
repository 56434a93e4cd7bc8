"""Controls on a mesh as straight lines: their extremes, integrals and variation, up to each member's end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.meshwise import MeshTrajectory


@dataclass(frozen=True)
class Lines:
    """Straight lines on the S steps of a mesh, for b members; of width 0 and value 0 outside what is looked at."""

    first: Floats
    """Values at the starts, (b, S) or (b, S, m)."""
    last: Floats
    """Values at the ends, shaped as `first`."""
    widths: Floats
    """Of the steps, (b, S)."""

    def least(self) -> Floats:
        """Return the least value, (b,) or (b, m); +inf where nothing is looked at."""
        return -Lines(-self.first, -self.last, self.widths).largest()

    def largest(self) -> Floats:
        """Return the largest value, (b,) or (b, m); -inf where nothing is looked at."""
        seen = _beside(self.widths, self.first) > 0.0
        highest: Floats = np.where(seen, np.maximum(self.first, self.last), -np.inf).max(axis=1)
        return highest

    def absolute_integral(self) -> Floats:
        """Return ∫ |value|, (b,) or (b, m)."""
        a, b = np.abs(self.first), np.abs(self.last)
        opposite, total = self.first * self.last < 0.0, a + b
        mean = np.where(opposite, (a * a + b * b) / np.where(opposite, total, 1.0), total) / 2.0
        integral: Floats = (mean * _beside(self.widths, self.first)).sum(axis=1)
        return integral

    def variation(self) -> Floats:
        """Return the total variation, (b,) or (b, m)."""
        total: Floats = np.abs(self.last - self.first).sum(axis=1)
        return total

    def share_outside(self, low: Floats, high: Floats) -> Floats:
        """Return the share of the width in which values (b, S) are not between two levels, (b,) each, (b,)."""
        below = Lines(-self.first, -self.last, self.widths)
        return self._share_above(high) + below._share_above(-low)

    def _share_above(self, level: Floats) -> Floats:
        a, b, at = self.first, self.last, level[:, None]
        rise = np.abs(b - a)
        crossing = np.clip((np.maximum(a, b) - at) / np.where(rise > 0.0, rise, 1.0), 0.0, 1.0)
        above = np.where(rise > 0.0, crossing, a >= at)
        share: Floats = (above * self.widths).sum(axis=1) / self.widths.sum(axis=1)
        return share

    def clipped(self, low: Floats, high: Floats) -> Lines:
        """Return the lines with their ends limited to [low, high], each (b, 1, m) or (b, 1)."""
        return Lines(np.clip(self.first, low, high), np.clip(self.last, low, high), self.widths)


def lines(trajectory: MeshTrajectory, values: Floats, begin: float = 0.0) -> Lines:
    """Return values on the mesh, (b, T) or (b, T, m), as lines from the time `begin` to each member's end."""
    times = trajectory.times
    h = np.diff(times)
    low = np.clip((begin - times[:-1]) / h, 0.0, 1.0)
    high = np.clip((trajectory.end[:, None] - times[:-1]) / h, low, 1.0)
    first = values[:, :-1]
    widths = (high - low) * h
    seen = _beside(widths, first) > 0.0
    with np.errstate(invalid="ignore"):
        change = np.diff(values, axis=1)
        starts = first + _beside(low + np.zeros_like(high), first) * change
        ends = first + _beside(high, first) * change
    return Lines(np.where(seen, starts, 0.0), np.where(seen, ends, 0.0), widths)


def controls(trajectory: MeshTrajectory, begin: float = 0.0) -> Lines:
    """Return the controls as lines, (b, S, m)."""
    limits = trajectory.limits
    return lines(trajectory, trajectory.demands, begin).clipped(limits[:, :1], limits[:, 1:])


def begin_of(after_orbits: float) -> float:
    """Return the true anomaly after a number of revolutions.

    Raises:
        ArgumentError: the number is negative or not finite.
    """
    if not 0.0 <= after_orbits < np.inf:
        raise ArgumentError("after_orbits", after_orbits, "must be a number from 0 on")
    return 2.0 * np.pi * after_orbits


def _beside(values: Floats, other: Floats) -> Floats:
    """Return (b, S) as (b, S, 1) where `other` has components."""
    return values[..., None] if other.ndim > values.ndim else values
