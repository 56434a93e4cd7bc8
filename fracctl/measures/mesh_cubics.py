"""Positions on a mesh as the cubics of their values and rates: last crossings and excursions, exact between times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.meshwise import MeshTrajectory

_HALVINGS = 53


@dataclass(frozen=True)
class Cubics:
    """The distance of a position of b members from a centre, as cubics on the S steps of a mesh.

    A cubic lies between the least and the largest of its control points, which tells in which steps nothing happens.
    """

    times: Floats
    """Starts of the steps, (S,)."""
    widths: Floats
    """Of the steps, (S,)."""
    points: Floats
    """Control points of the cubics, (4, b, S); 0 behind a member's end."""
    shares: Floats
    """How much of each step lies before the member's end, in [0, 1], (b, S)."""
    ended: Array
    """Whether a member ended before the horizon, (b,)."""

    def last_crossing(self, level: Floats) -> Floats:
        """Return the last time at which |distance| = level, (b,), for levels (b,).

        0 where it never was above, +inf where it is above at the horizon or the member ended before.
        """
        reaches = (np.abs(self.points).max(axis=0) > level[:, None]) & (self.shares > 0.0)
        found = np.where(self.ended | (np.abs(self.points[3, :, -1]) > level), np.inf, 0.0)
        pending = np.flatnonzero((found == 0.0) & reaches.any(axis=1))
        while pending.size:
            last = reaches.shape[1] - 1 - np.argmax(reaches[pending, ::-1], axis=1)
            y = _last_crossing(self.points[:, pending, last], level[pending])
            crossed = y >= 0.0
            found[pending[crossed]] = (self.times[last] + y * self.widths[last])[crossed]
            reaches[pending, last] = False
            pending = pending[~crossed & reaches[pending].any(axis=1)]
        return found

    def largest(self, side: Floats) -> Floats:
        """Return the largest distance on a side (b,), of either where that is 0; at least 0, up to a member's end."""
        best = np.zeros(len(side))
        for sign in (1.0, -1.0):
            best = np.maximum(best, np.where(side == -sign, 0.0, self._highest(sign)))
        return best

    def _highest(self, sign: float) -> Floats:
        """Return the largest sign · distance, (b,)."""
        best: Floats = np.where(self.shares > 0.0, sign * self.points[0], 0.0).max(axis=1)
        within = np.where(self.shares > 0.0, (sign * self.points).max(axis=0), -np.inf)
        rows, steps = np.nonzero((within > best[:, None]) & (self.shares > 0.0))
        points, share = self.points[:, rows, steps], self.shares[rows, steps]
        for y in (*_turns(points, share), share):
            np.maximum.at(best, rows, sign * _at(points, y))
        return best


def cubics(trajectory: MeshTrajectory, component: int, centre: Floats) -> Cubics:
    """Return the distance of a component from a centre (b,) as cubics."""
    m, times = trajectory.on_mesh.shape[2] // 2, trajectory.times
    widths = np.diff(times)
    value = trajectory.on_mesh[..., component] - centre[:, None]
    third = trajectory.on_mesh[..., m + component] / 3.0
    shares = np.clip((trajectory.end[:, None] - times[:-1]) / widths, 0.0, 1.0)
    first, last = value[:, :-1], value[:, 1:]
    with np.errstate(invalid="ignore"):
        points = np.stack([first, first + widths * third[:, :-1], last - widths * third[:, 1:], last])
    points[:, shares == 0.0] = 0.0
    return Cubics(times[:-1], widths, points, shares, trajectory.end < trajectory.horizon)


def _at(points: Floats, y: Floats) -> Floats:
    """Return cubics (4, k) at shares (k,) of their steps, (k,)."""
    x = 1.0 - y
    value: Floats = x**3 * points[0] + 3.0 * x * y * (x * points[1] + y * points[2]) + y**3 * points[3]
    return value


def _turns(points: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Return where cubics (4, k) turn, as shares of their steps in [0, share], (k,) each; `share` where they do not."""
    start, middle, end = np.diff(points, axis=0)
    half, bend = middle - start, start - 2.0 * middle + end
    with np.errstate(all="ignore"):
        root = -(half + np.copysign(np.sqrt(half**2 - bend * start), half))
        first, second = root / bend, start / root
    inside = [np.where((y > 0.0) & (y < share), y, share) for y in (first, second)]
    return inside[0], inside[1]


def _last_crossing(points: Floats, level: Floats) -> Floats:
    """Return where |cubics| (4, k) fall to levels (k,) for the last time, as shares of their steps, (k,), -1 if never.

    Between their ends and turns they are monotone.
    """
    whole = np.ones(len(level))
    stops = np.sort(np.stack([0.0 * whole, *_turns(points, whole), whole]), axis=0)
    above = np.stack([np.abs(_at(points, y)) > level for y in stops])
    low, high = -whole, -whole
    for j in range(3):
        falls = above[j] & ~above[j + 1]
        low, high = np.where(falls, stops[j], low), np.where(falls, stops[j + 1], high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        out = np.abs(_at(points, middle)) > level
        low, high = np.where(out, middle, low), np.where(out, high, middle)
    return high
