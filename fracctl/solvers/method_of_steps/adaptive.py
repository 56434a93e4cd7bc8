"""Steps with a delay that adapts: delayed states are looked up at each stage.

The delay is a state of its own. What is not smooth at a time ξ is felt again where t - τ(t) = ξ; such times are found
on the way, and each ends a step, as every renewal does.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable

import numpy as np

from fracctl.arrays import Floats
from fracctl.compiling import compiled
from fracctl.controllers.adaptive_delay import AdaptiveDelayedFeedback
from fracctl.controllers.delayed_feedback import DelayedTerm
from fracctl.controllers.saturation import Saturation
from fracctl.plants.state import StatePlant
from fracctl.solvers import dop853
from fracctl.stepwise import Steps

_CHECK = 64
"""Steps between two questions whether anybody still has a way to go."""
_ORDER = 9
"""A jump is felt in a derivative one higher after every delay; beyond this one the method does not see it."""
_TRIALS = 5
"""Of a step that has to end where t - τ(t) meets a break."""
_HALVINGS = 50
_SAME = 1e-10
"""Two times closer than this share of a delay are one."""
_FEWEST = 2.0
"""Steps in the shortest delay: the delayed time must lie before the step."""


class AdaptiveRun:
    """Members on their way; `state` is [x, τ] and the two integrals of a renewal, (b, n + 3).

    A member whose delay falls below two steps, or reaches before time 0, becomes NaN.

    Args:
        plant: the plant.
        law: tells how the delay adapts.
        term: its term, with batch axes.
        saturation: of the control.
        count: N, steps in the first delay.
        start: x(0), (b, n).
    """

    def __init__(
        self,
        plant: StatePlant,
        law: AdaptiveDelayedFeedback,
        term: DelayedTerm,
        saturation: Saturation | None,
        count: int,
        start: Floats,
    ) -> None:
        b, self._n = start.shape
        self._plant, self._term, self._saturation = plant, term, saturation
        self._rate, self._per_orbit = np.broadcast_to(law.rate, (b,)), law.renewal == "per_orbit"
        self._width, self._same = term.delay / count, _SAME * term.delay
        self._time, self._on = np.zeros(b), np.zeros(b, dtype=bool)
        self._state = np.concatenate([start, term.delay[:, None], np.zeros((b, 2))], axis=1)
        self._adapting, self._begin = np.zeros(b, dtype=bool), np.maximum(law.adapt_from, term.switch_on)
        self._renewal = np.array(term.switch_on)
        self._breaks: list[list[float]] = [[] for _ in range(b)]
        self._levels: list[dict[float, int]] = [{} for _ in range(b)]
        self._low, self._high = np.full(b, -np.inf), np.full(b, np.inf)
        self._taken, room = 0, 2 * count
        self._edges = np.full((b, room + 1), np.inf)
        self._edges[:, 0] = 0.0
        self._rows = np.full((room, dop853.ROWS, b, self._n), np.nan)
        self._delays = np.full((room, dop853.ROWS, b, 1), np.nan)

    def until(self, horizon: float, finished: Callable[[Steps, int], bool]) -> Steps:
        """Return the states of all members, with their delays, to the horizon or beyond.

        Args:
            horizon: last time.
            finished: asked now and then, with the states so far and the number of steps taken; True ends the run.
        """
        while np.any(self._time < horizon):
            self._advance()
            if self._taken % _CHECK == 0 and finished(self._steps(), self._taken):
                break
        return self._steps()

    def _steps(self) -> Steps:
        edges = np.ascontiguousarray(self._edges[:, : self._taken + 1])
        return Steps(edges, self._rows[: self._taken], None, Steps(edges, self._delays[: self._taken], None))

    def _advance(self) -> None:
        """Take one step, which ends early where a renewal is due or an echo is felt."""
        due = self._renewal <= self._time + self._width
        h = np.where(due, self._renewal - self._time, self._width)
        for _ in range(_TRIALS):
            values = self._step(h)
            rows = (dop853.DENSE @ values).reshape(dop853.ROWS, *self._state.shape)
            end = (dop853.COMBINE[dop853.END] @ values).reshape(self._state.shape)
            beyond = self._on & (self._time + h - end[:, self._n] > self._high + self._same)
            if not beyond.any():
                break
            h, due = np.where(beyond, h * self._share(h, rows[:, :, self._n]), h), due & ~beyond
        self._time = np.where(due, self._renewal, self._time + h)
        self._state = end
        self._store(rows)
        behind = self._time - end[:, self._n]
        self._state[self._on & ((behind < -self._same) | (end[:, self._n] < _FEWEST * self._width))] = np.nan
        for i in np.flatnonzero(self._on & (behind > self._high - self._same)):
            self._echo(int(i))
        for i in np.flatnonzero(due):
            self._renew(int(i))

    def _share(self, h: Floats, delay: Floats) -> Floats:
        """Return the shares of steps h at which t - τ(t) meets the next break, τ by its extension (8, b)."""
        low, high = np.zeros_like(h), np.ones_like(h)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            over = self._time + middle * h - (dop853.basis(middle).T * delay).sum(axis=0) > self._high
            low, high = np.where(over, low, middle), np.where(over, middle, high)
        return high

    def _step(self, h: Floats) -> Floats:
        """Return Y = [z, h k_1, …, h k_16] of one step of the states z, (17, b (n + 3))."""
        values = np.empty((dop853.STAGES + 1, self._state.size))
        values[0] = self._state.ravel()
        for s in range(dop853.STAGES):
            z = (dop853.COMBINE[s, : s + 1] @ values[: s + 1]).reshape(self._state.shape)
            values[s + 1] = (h[:, None] * self._rates(self._time + dop853.NODES[s] * h, z)).ravel()
        return values

    def _rates(self, t: Floats, z: Floats) -> Floats:
        n, on = self._n, self._on[:, None]
        x, out = np.ascontiguousarray(z[:, :n]), np.zeros_like(z)
        demand = np.zeros((len(x), self._plant.n_controls))
        if on.any():
            past, slope = self._delayed(t - z[:, n])
            error = x - past
            demand = np.where(on, -np.einsum("bmn,bn->bm", self._term.gains(t[:, None])[:, 0], error), 0.0)
            grown = np.where(on, np.stack([(error * slope).sum(axis=1), (slope**2).sum(axis=1)], axis=1), 0.0)
            if self._per_orbit:
                out[:, n + 1 :] = grown
            else:
                out[:, n] = np.where(self._adapting, -self._rate * grown[:, 0], 0.0)
        control = demand if self._saturation is None else self._saturation(demand)
        out[:, :n] = self._plant.rates(t, x, control)
        return out

    def _delayed(self, times: Floats) -> tuple[Floats, Floats]:
        """Return states and their slopes at times (b,), on this side of the next break, both (b, n)."""
        inset = 1e-13 * (1.0 + np.abs(times))
        times = np.where(np.abs(times - self._low) < self._same, self._low + inset, times)
        times = np.clip(np.minimum(times, self._high - inset), 0.0, self._time)
        past, slope = np.empty((2, len(times), self._n))
        _look_up_with_slope(self._edges, self._rows, self._taken, times, past, slope)
        return past, slope

    def _store(self, rows: Floats) -> None:
        if self._taken == len(self._rows):
            self._edges = np.concatenate([self._edges, np.full_like(self._edges[:, 1:], np.inf)], axis=1)
            self._rows = np.concatenate([self._rows, np.full_like(self._rows, np.nan)])
            self._delays = np.concatenate([self._delays, np.full_like(self._delays, np.nan)])
        self._rows[self._taken], self._delays[self._taken] = rows[..., : self._n], rows[..., self._n, None]
        self._taken += 1
        self._edges[:, self._taken] = self._time

    def _echo(self, i: int) -> None:
        """The delayed time of a member has met a break."""
        self._break(i, self._levels[i][float(self._high[i])] + 1)

    def _renew(self, i: int) -> None:
        """Control begins, adaptation begins, or a new delay is taken."""
        delay, moved, square = self._state[i, self._n :]
        if self._adapting[i]:
            self._state[i, self._n] = delay - self._rate[i] * moved / square
        self._state[i, self._n + 1 :] = 0.0
        self._on[i] = True
        self._adapting[i] = self._time[i] >= self._begin[i]
        later = self._time[i] + self._state[i, self._n] if self._per_orbit else np.inf
        self._renewal[i] = later if self._adapting[i] else self._begin[i]
        self._break(i, 1)

    def _break(self, i: int, level: int) -> None:
        """Remember a break now, and look for the next one that the delayed time will meet."""
        now, breaks = float(self._time[i]), self._breaks[i]
        if level <= _ORDER and now not in self._levels[i]:
            breaks.append(now)
            self._levels[i][now] = level
        place = bisect_right(breaks, now - self._state[i, self._n] + self._same[i])
        self._low[i] = breaks[place - 1] if place else -np.inf
        self._high[i] = breaks[place] if place < len(breaks) else np.inf


@compiled
def _look_up_with_slope(
    edges: Floats, coefficients: Floats, taken: int, times: Floats, value: Floats, slope: Floats
) -> None:
    for i in range(len(times)):
        step = min(max(np.searchsorted(edges[i], times[i], "right") - 1, 0), taken - 1)
        width = edges[i, step + 1] - edges[i, step]
        y = (times[i] - edges[i, step]) / width
        for k in range(value.shape[1]):
            total, rise = coefficients[step, 7, i, k], 0.0
            for j in range(6, -1, -1):
                factor = y if j % 2 == 0 else 1.0 - y
                rise = factor * rise + (total if j % 2 == 0 else -total)
                total = coefficients[step, j, i, k] + factor * total
            value[i, k], slope[i, k] = total, rise / width
