"""When the events of a plant happen on the steps of a batch."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.plants.state import Event
from fracctl.solvers import dop853
from fracctl.stepwise import Steps

_PLACES: Floats = np.arange(9) / 8.0
"""Where in a step a function is asked for its sign; what falls below zero and rises again between two is missed."""
_HALVINGS = 50


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
