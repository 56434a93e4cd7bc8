"""The result of a solve: what all trajectories share, and those on panels, with status, certificate and counters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Booleans, Floats, finite
from fracctl.errors import ArgumentError
from fracctl.panels import PanelGrid


class AnyTrajectory(ABC):
    """What the trajectories of all solvers share: b motions over time, how they ended, and what they cost.

    States and controls carry the batch axis only where loop or initial state did. Behind the `end` of a member they are
    NaN.
    """

    end: Floats
    """When each member ended: the horizon, a terminal event, or where it could not be followed, (b,)."""
    events: Mapping[str, Floats]
    """First time of each event of the plant, NaN where it did not happen, each (b,)."""
    status: Array
    """A word each, (b,), e.g. ``ok``, ``failed`` or the name of a terminal event."""
    error_estimate: Floats
    """Largest estimated error relative to the peak, (b,)."""
    counters: Mapping[str, Array]
    """What the solve cost, each (b,)."""
    batched: bool
    """Whether results carry the batch axis."""

    if TYPE_CHECKING:

        @property
        def horizon(self) -> float:
            """Dimensionless end time."""
            ...

        @property
        def times(self) -> Floats:
            """Times of `states` and `controls`, (t,)."""
            ...

    @property
    def states(self) -> Floats:
        """States at `times`, (b, t, n), or (t, n) for a single loop."""
        return self(self.times)

    @property
    def controls(self) -> Floats:
        """Controls at `times`, (b, t, m), or (t, m) for a single loop."""
        return self.control(self.times)

    @abstractmethod
    def __call__(self, times: ArrayLike) -> Floats:
        """Return the states at times (t,) in [0, horizon], (b, t, n), or (t, n) for a single loop."""

    @abstractmethod
    def control(self, times: ArrayLike) -> Floats:
        """Return the controls at times (t,) in [0, horizon], (b, t, m), or (t, m) for a single loop."""

    def _shown(self, times: ArrayLike, values: Floats) -> Floats:
        """Return values (b, t, …) at times (t,) or (b, t), NaN behind the ends of members."""
        values[np.asarray(times) > np.where(self.end < self.horizon, self.end, np.inf)[:, None]] = np.nan
        return values if self.batched else values[0]

    def _checked(self, times: ArrayLike, own: bool = False) -> Floats:
        """Return times as (1, t), or (b, t) where members may have their `own`, or refuse them."""
        t = np.atleast_1d(finite("times", times))
        batch = len(self.end)
        if t.ndim > 1 + own or (t.ndim == 2 and len(t) != batch):
            allowed = f"must have shape (t,) or ({batch}, t)" if own else "must have shape (t,)"
            raise ArgumentError("times", f"of shape {t.shape}", allowed)
        if t.size and (t.min() < 0.0 or t.max() > self.horizon * (1.0 + 1e-12)):
            wrong = t.min() if t.min() < 0.0 else t.max()
            raise ArgumentError("times", float(wrong), f"must lie in [0, {self.horizon:g}], the solved horizon")
        return np.atleast_2d(t)


@dataclass(frozen=True)
class Trajectory(AnyTrajectory):
    """Trajectories of a batch of b loops with m positions, on the T nodes of a grid of panels."""

    grid: PanelGrid
    """Panels that cover (0, horizon]."""
    initial_state: Floats
    """[ξ(0), ξ'(0), z(0)], (b, n)."""
    positions: Floats
    """ξ at the nodes, (b, m, T)."""
    controls_at_nodes: Floats
    """υ at the nodes, (b, m, T)."""
    initial_controls: Floats
    """υ(0+), (b, m); a law with order α < 1 rises from it as t^(1-α)."""
    rates: Floats | None
    """ξ' at the nodes, (b, m, T); None where the solver left them to the derivative of the interpolant."""
    auxiliary: Floats
    """z at the nodes, (b, q, T)."""
    end: Floats
    """When each member ended: the horizon, a terminal event, or 0 where there is no trajectory, (b,)."""
    events: Mapping[str, Floats]
    status: Array
    """A word each, (b,): ``ok``, the name of a terminal event, ``unstable``, ``diverged`` or ``failed`` (the
    certificate was not met)."""
    stable: Array
    """True, False, or None for a marginal loop, (b,) objects."""
    error_estimate: Floats
    """Largest estimated error of positions and controls relative to their peaks, (b,)."""
    counters: Mapping[str, Array]
    """``nodes``, each (b,)."""
    batched: bool = True

    @property
    def horizon(self) -> float:
        """Dimensionless end time."""
        return self.grid.horizon

    @property
    def missing(self) -> Booleans:
        """Whether a member has no trajectory, (b,)."""
        return np.isnan(self.positions[:, 0, -1])

    @property
    def times(self) -> Floats:
        """Times of `states` and `controls`, (t,): 0 and the nodes of all panels."""
        return np.concatenate([[0.0], self.grid.times[self._distinct]])

    def __call__(self, times: ArrayLike) -> Floats:
        """Return the states at any times (t,) in [0, horizon], (b, t, n), or (t, n) for a single loop.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = self._checked(times)[0]
        rates = self.grid.derivative(self.positions) if self.rates is None else self.rates
        values = np.concatenate([self.positions, rates, self.auxiliary], axis=1)
        out = np.swapaxes(self.grid.evaluate(values, t), 1, 2)
        first = self.grid.panels[0].start
        early = t < first
        if early.any():
            m = self.positions.shape[1]
            drift = np.zeros_like(self.initial_state)
            drift[:, :m] = self.initial_state[:, m : 2 * m]
            out[:, early] = self.initial_state[:, None] + drift[:, None] * t[early, None]
        return self._shown(t, out)

    def control(self, times: ArrayLike) -> Floats:
        """Return the controls at any times (t,) in [0, horizon], (b, t, m), or (t, m) for a single loop.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = self._checked(times)[0]
        out = np.swapaxes(self.grid.evaluate(self.controls_at_nodes, t), 1, 2)
        out[:, t == 0.0] = self.initial_controls[:, None]
        return self._shown(t, out)

    @property
    def _distinct(self) -> Array:
        return np.flatnonzero(np.diff(self.grid.times, prepend=-1.0) > 0.0)
