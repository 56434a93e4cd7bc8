"""When the events of a plant happen on the steps of a batch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.plants.state import Event
from fracctl.solvers import dop853
from fracctl.stepwise import Steps

_PLACES: Floats = np.arange(9) / 8.0
"""Where in a step a function is asked for its sign; what falls below zero and rises again between two is missed: on
steps that a member chose for itself a distance below its limit by a share of less than 2e-6."""
_HALVINGS = 50


class Watch:
    """What ends the members of a run, and when; a call tells it of new steps, and tells whether all have ended.

    Args:
        events: of the plant.
        end: when members end at the latest, (b,).
    """

    def __init__(self, events: Sequence[Event], end: Floats) -> None:
        self._events, self._seen = events, 0
        self.end = end.copy()
        self.times = {event.name: np.full(len(end), np.nan) for event in events}

    def __call__(self, steps: Steps, taken: int) -> bool:
        """Look at the steps up to `taken`; True if nobody has a way to go."""
        seen, end = self._seen, self.end
        for event in self._events:
            waiting = np.flatnonzero(np.isnan(self.times[event.name]) & (end > steps.edges[:, seen]))
            times = first_times(event, steps, seen, taken, waiting)
            new, times = waiting[times <= end[waiting]], times[times <= end[waiting]]
            self.times[event.name][new] = times
            if event.terminal:
                end[new] = times
        broken = ~np.isfinite(steps.coefficients[taken - 1]).all(axis=(0, 2))
        for i in np.flatnonzero(broken & (end > steps.edges[:, seen])):
            bad = ~np.isfinite(steps.coefficients[seen:taken, :, i]).all(axis=(1, 2))
            end[i] = min(end[i], steps.edges[i, seen + int(np.argmax(bad))])
        self._forget_later()
        self._seen = taken
        return bool(np.all(end <= steps.edges[:, taken]))

    def look_at_rest(self, steps: Steps) -> None:
        """Look at the steps that nobody was asked about."""
        count = len(steps.coefficients)
        if self._seen < count and not np.all(self.end <= steps.edges[:, self._seen]):
            self(steps, count)

    def diverged(self, latest: float) -> Booleans:
        """Return who ended before the latest time without an event, (b,)."""
        out: Booleans = self.end < latest
        for event in self._events:
            if event.terminal:
                out = out & (self.times[event.name] != self.end)
        return out

    def stop(self, member: int, time: float) -> None:
        """End a member at a time, if it has not ended before; nothing later has happened to it."""
        self.end[member] = min(self.end[member], time)
        self._forget_later()

    def take(self, members: Array, other: Watch, places: Array) -> None:
        """Take over for some members what another watch has found at some places of its own."""
        self.end[members] = other.end[places]
        for name, times in other.times.items():
            self.times[name][members] = times[places]

    def _forget_later(self) -> None:
        for times in self.times.values():
            times[times > self.end] = np.nan


def first_times(event: Event, steps: Steps, first: int, stop: int, members: Array) -> Floats:
    """Return the first time in steps `first` … `stop` - 1 of some members (r,), NaN where there is none, (r,)."""
    rows = steps.coefficients[first:stop]
    if len(members) < rows.shape[2]:
        rows = rows[:, :, members]
    count, _, r, n = rows.shape
    starts, widths = steps.edges[members, first:stop].T, np.diff(steps.edges[members, first : stop + 1]).T
    times = starts[:, None] + widths[:, None] * _PLACES[:, None]
    states = (dop853.basis(_PLACES) @ rows.reshape(count, dop853.ROWS, r * n)).reshape(-1, n)
    below = (event.function(times.ravel(), states) < 0.0).reshape(count * len(_PLACES), r)
    found = np.flatnonzero(below.any(axis=0))
    out = np.full(r, np.nan)
    if not found.size:
        return out
    step, place = np.divmod(np.argmax(below[:, found], axis=0), len(_PLACES))
    pieces = rows[step, :, found]
    high = _PLACES[place]
    low = np.where(place > 0, _PLACES[place - 1], 0.0)
    start, width = starts[step, found], widths[step, found]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        states = np.einsum("fr,frn->fn", dop853.basis(middle), pieces)
        inside = event.function(start + width * middle, states) < 0.0
        low, high = np.where(inside, low, middle), np.where(inside, middle, high)
    out[found] = start + width * high
    return out
