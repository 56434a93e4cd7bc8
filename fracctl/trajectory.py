"""The result of a solve: functions of time on panels, with status, certificate and counters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Booleans, Floats, finite
from fracctl.errors import ArgumentError
from fracctl.panels import PanelGrid


@dataclass(frozen=True)
class Trajectory:
    """Trajectories of a batch of b loops with m positions, on the T nodes of a grid of panels.

    `states` and `controls` carry the batch axis only where loop or initial state did.
    """

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
    status: Array
    """A word each, (b,): ``ok``, ``unstable``, ``diverged`` or ``failed`` (the certificate was not met)."""
    stable: Array
    """True, False, or None for a marginal loop, (b,) objects."""
    error_estimate: Floats
    """Largest estimated error of positions and controls relative to their peaks, (b,)."""
    counters: Mapping[str, Array]
    """What the solve cost, e.g. ``nodes``, each (b,)."""
    batched: bool = True
    """Whether results carry the batch axis."""

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

    @property
    def states(self) -> Floats:
        """States at `times`, (b, t, n), or (t, n) for a single loop."""
        return self(self.times)

    @property
    def controls(self) -> Floats:
        """Controls at `times`, (b, t, m), or (t, m) for a single loop."""
        return self.control(self.times)

    def __call__(self, times: ArrayLike) -> Floats:
        """Return the states at any times (t,) in [0, horizon], (b, t, n), or (t, n) for a single loop.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = self._checked(times)
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
        return out if self.batched else out[0]

    def control(self, times: ArrayLike) -> Floats:
        """Return the controls at any times (t,) in [0, horizon], (b, t, m), or (t, m) for a single loop.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = self._checked(times)
        out = np.swapaxes(self.grid.evaluate(self.controls_at_nodes, t), 1, 2)
        out[:, t == 0.0] = self.initial_controls[:, None]
        return out if self.batched else out[0]

    @property
    def _distinct(self) -> Array:
        return np.flatnonzero(np.diff(self.grid.times, prepend=-1.0) > 0.0)

    def _checked(self, times: ArrayLike) -> Floats:
        t = np.atleast_1d(finite("times", times))
        if t.size and (t.min() < 0.0 or t.max() > self.horizon * (1.0 + 1e-12)):
            wrong = t.min() if t.min() < 0.0 else t.max()
            raise ArgumentError("times", float(wrong), f"must lie in [0, {self.horizon:g}], the solved horizon")
        return t
