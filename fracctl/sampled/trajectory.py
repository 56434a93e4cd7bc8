"""The result of a sampled flight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite
from fracctl.errors import ArgumentError
from fracctl.plants.state import StatePlant


@dataclass(frozen=True)
class SampledTrajectory:
    """Flights of b members over K periods, with n states and m controls.

    What a single flight returns lacks the batch axis in `states` and `controls` only; the fields have it.
    """

    plant: StatePlant
    period: float
    """T_s."""
    delay: float
    """Of the controls, in periods."""
    at_samples: Floats
    """x(k T_s), (b, K + 1, n); NaN after a member has diverged."""
    commands: Floats
    """u_k, held from (k + delay) T_s for a period, (b, K, m)."""
    saturated_share: Floats
    """Share of the periods in which the control was at its limit, (b,)."""
    status: Array
    """``ok`` or ``diverged``, (b,)."""
    batched: bool = True

    @property
    def times(self) -> Floats:
        """k T_s, (K + 1,)."""
        return np.asarray(self.period * np.arange(self.at_samples.shape[1]), dtype=np.float64)

    @property
    def switching_times(self) -> Floats:
        """0, all (k + delay) T_s at which a command begins to act, and the horizon; controls are constant between."""
        begins = (np.arange(self.commands.shape[1]) + self.delay) * self.period
        return np.unique(np.concatenate([[0.0], begins[begins < self.horizon], [self.horizon]]))

    @property
    def horizon(self) -> float:
        """K T_s."""
        return self.period * float(self.at_samples.shape[1] - 1)

    @property
    def states(self) -> Floats:
        """States at `times`, (b, K + 1, n), or (K + 1, n) for a single flight."""
        return self.at_samples if self.batched else self.at_samples[0]

    @property
    def controls(self) -> Floats:
        """The commands u_k, (b, K, m), or (K, m) for a single flight."""
        return self.commands if self.batched else self.commands[0]

    def __call__(self, times: ArrayLike) -> Floats:
        """Return states at any times (t,) in [0, horizon], (b, t, n), or (t, n) for a single flight.

        By Hermite's cubics through positions and velocities at the samples. Between them the control may jump by |Δu|:
        then positions err by |Δu| T_s²/50 at most, otherwise by the order T_s⁴.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = np.atleast_1d(finite("times", times))
        wrong = t[(t < 0.0) | (t > self.horizon * (1.0 + 1e-12))]
        if wrong.size:
            raise ArgumentError("times", float(wrong[0]), f"must lie in [0, {self.horizon:g}], the flight")
        k = np.minimum((t / self.period).astype(int), self.at_samples.shape[1] - 2)
        coefficients, theta = self.cubics(k), (t / self.period - k)[:, None]
        slope = (coefficients[1] + theta * (2.0 * coefficients[2] + 3.0 * theta * coefficients[3])) / self.period
        out = np.concatenate([cubic(coefficients, theta), slope], axis=-1)
        return out if self.batched else out[0]

    def control(self, times: ArrayLike) -> Floats:
        """Return the controls that act at times (t,), (b, t, m), or (t, m) for a single flight."""
        k = np.floor(np.atleast_1d(finite("times", times)) / self.period - self.delay + 1e-9).astype(int)
        known = np.clip(k, 0, self.commands.shape[1] - 1)
        out = np.where((k >= 0)[:, None], self.commands[:, known], 0.0)
        return out if self.batched else out[0]

    def cubics(self, k: Array) -> Floats:
        """Return coefficients of 1, θ, θ², θ³ of the positions on [k, k + θ] periods, (4, b, len(k), m)."""
        m = self.commands.shape[2]
        left, right = self.at_samples[:, k], self.at_samples[:, k + 1]
        start, end = left[..., :m], right[..., :m]
        slope, last = self.period * left[..., m : 2 * m], self.period * right[..., m : 2 * m]
        rise = end - start
        return np.stack([start, slope, 3.0 * rise - 2.0 * slope - last, slope + last - 2.0 * rise])


def cubic(coefficients: Floats, theta: Floats) -> Floats:
    """Return the values at θ of polynomials with coefficients of 1, θ, θ², θ³ along the first axis."""
    c0, c1, c2, c3 = coefficients
    value: Floats = c0 + theta * (c1 + theta * (c2 + theta * c3))
    return value
