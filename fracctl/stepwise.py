"""Trajectories of one-step methods: polynomials on steps, each member of a batch with steps of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats
from fracctl.compiling import compiled
from fracctl.controllers.delayed_feedback import DelayedTerm, History
from fracctl.controllers.saturation import Saturation
from fracctl.errors import UnsupportedError
from fracctl.plants.state import StatePlant
from fracctl.trajectory import AnyTrajectory


@dataclass(frozen=True)
class Steps:
    """States of b members on S steps; before time 0 their history."""

    edges: Floats
    """Ends of the steps, (b, S + 1)."""
    coefficients: Floats
    """Of the polynomials of `solvers.dop853.basis` in the share of the step that has passed, (S, 8, b, n)."""
    history: History | None
    delay: Steps | None = None
    """τ of members whose delay adapts, with one component."""

    def __call__(self, times: Floats) -> Floats:
        """Return the states at times (b, k), (b, k, n); outside the steps the nearest polynomial is continued."""
        out = np.empty((*times.shape, self.coefficients.shape[-1]))
        _look_up(self.edges, self.coefficients, times, out)
        early = times < 0.0
        if self.history is not None and early.any():
            out[early] = np.broadcast_to(self.history(np.minimum(times, 0.0)), out.shape)[early]
        return out

    def reference(self, term: DelayedTerm, times: Floats) -> Floats:
        """Return W(t) = (1 - R) x(t - τ) + R W(t - τ) at times (b, k), (b, k, n); W = x where x(t - τ) is unknown."""
        if self.delay is not None:
            return self(times - self.delay(times)[..., 0])
        delay, recall = term.delay[:, None], term.recall[:, None]
        first = 0.0 if self.history is not None else delay
        total: Floats = np.zeros((*times.shape, self.coefficients.shape[-1]))
        weight, now = np.ones(times.shape), times
        while True:
            known = (now >= first) & (weight > 1e-18)
            if not known.any():
                return total + weight[..., None] * self(now) if weight.any() else total
            now = np.where(known, now - delay, now)
            share = np.where(known, weight * (1.0 - recall), 0.0)
            total = total + share[..., None] * self(now)
            weight = np.where(known, weight * recall, weight)


@dataclass(frozen=True)
class StepwiseTrajectory(AnyTrajectory):
    """Trajectories of a batch of b loops with n states and m controls."""

    plant: StatePlant
    steps: Steps
    terms: tuple[DelayedTerm, ...]
    """Of the control, with batch axes."""
    saturation: Saturation | None
    """What the thrusters can give."""
    horizon: float
    end: Floats
    events: Mapping[str, Floats]
    status: Array
    """A word each, (b,): ``ok``, the name of a terminal event, ``diverged`` (not finite, or too fast for its steps) or
    ``failed`` (above the tolerance)."""
    error_estimate: Floats
    """Largest estimated error of the states relative to their peak, from a run with half the steps, (b,); infinite
    where that run did not last as long."""
    counters: Mapping[str, Array]
    """What the solve cost, ``steps``, each (b,)."""
    batched: bool = True

    @cached_property
    def times(self) -> Floats:
        """Times of `states` and `controls`: the ends of the steps, (t,), or (b, t) where members have their own."""
        edges = np.minimum(self.steps.edges, self.horizon)
        shared = bool(np.all(edges == edges[:1]))
        return edges[0] if shared else edges

    def __call__(self, times: ArrayLike) -> Floats:
        """Return the states at times (t,), or (b, t) for each member its own, (b, t, n), or (t, n) for a single loop.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        return self._shown(times, self.steps(self._own(times)))

    def control(self, times: ArrayLike) -> Floats:
        """Return the controls at times as in a call, (b, t, m), or (t, m); at a jump what follows it.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        demand = self._demand(self._own(times))
        return self._shown(times, demand if self.saturation is None else self.saturation(demand))

    def delay(self, times: ArrayLike) -> Floats:
        """Return the delay of the first term at times as in a call, (b, t), or (t,) for a single loop.

        Raises:
            UnsupportedError: the motion is free.
            ArgumentError: a time lies outside [0, horizon].
        """
        if not self.terms:
            raise UnsupportedError("a free motion has no delay")
        t = self._own(times)
        constant = np.array(np.broadcast_to(self.terms[0].delay[:, None], t.shape))
        return self._shown(times, constant if self.steps.delay is None else self.steps.delay(t)[..., 0])

    def demand(self, times: ArrayLike) -> Floats:
        """Return what the control would be without saturation, as `control` returns the control.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        return self._shown(times, self._demand(self._own(times)))

    def _demand(self, t: Floats) -> Floats:
        total = np.zeros((*t.shape, self.plant.n_controls))
        states = self.steps(t)
        for term in self.terms:
            difference = states - self.steps.reference(term, t)
            active = t >= term.switch_on[:, None]
            total -= np.where(active[..., None], np.einsum("btmn,btn->btm", term.gains(t), difference), 0.0)
        return total

    def _own(self, times: ArrayLike) -> Floats:
        t = self._checked(times, own=True)
        return np.broadcast_to(t, (len(self.end), t.shape[1]))


@compiled
def _look_up(edges: Floats, coefficients: Floats, times: Floats, out: Floats) -> None:
    last = edges.shape[1] - 2
    for i in range(times.shape[0]):
        for j in range(times.shape[1]):
            step = min(max(np.searchsorted(edges[i], times[i, j], "right") - 1, 0), last)
            y = (times[i, j] - edges[i, step]) / (edges[i, step + 1] - edges[i, step])
            z = 1.0 - y
            for k in range(out.shape[2]):
                c = coefficients[step, :, i, k]
                inner = c[4] + y * (c[5] + z * (c[6] + y * c[7]))
                out[i, j, k] = c[0] + y * (c[1] + z * (c[2] + y * (c[3] + z * inner)))
