"""Thrusters: what becomes of the control that a law demands for a period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Booleans, Floats, finite
from fracctl.controllers.saturation import Saturation
from fracctl.errors import ArgumentError


@dataclass(frozen=True)
class Actuator:
    """Deadband, then saturation, then the minimum impulse bit, for controls that are held for a period.

        |w_i| < deadband → 0;        saturation by axis or by norm;        |u_i| T_s < bit: the nearer of 0 and bit

    With a limit by norm one engine is turned, and the bit is one of |u|: the direction stays.

    What a spacecraft then feels is `efficiency` times that: thrust off its nominal value, a mass that is not the one
    the law takes it for.

    A thruster of fixed thrust gives the impulse u_i T_s by its pulse width; it cannot fire shorter than its minimum
    impulse bit. The impulse counts as spread evenly over the period, which changes positions by a F T_s²/8 at most for
    a thruster of acceleration a F.

    Args:
        saturation: `fracctl.controllers.Saturation`; None for no limit.
        deadband: () or (m,), accelerations over the plant's scale.
        impulse_bit: () or (m,), velocities over the plant's scale; with a limit by norm ().
        efficiency: acceleration given over that asked for, () or (b,), of all axes.

    Raises:
        ArgumentError: a number is negative, an efficiency not positive, or a limit by norm has bits of axes beside it.
    """

    saturation: Saturation | None = None
    deadband: ArrayLike = 0.0
    impulse_bit: ArrayLike = 0.0
    efficiency: ArrayLike = 1.0

    def __post_init__(self) -> None:
        for name in ("deadband", "impulse_bit"):
            value = finite(name, getattr(self, name))
            if value.ndim > 1 or (value < 0.0).any():
                raise ArgumentError(name, value.tolist(), "must be a number or (m,), and not negative")
            object.__setattr__(self, name, value)
        share = finite("efficiency", self.efficiency)
        if share.ndim > 1 or not (share > 0.0).all():
            raise ArgumentError("efficiency", share.tolist(), "must be a number or (b,), and positive")
        object.__setattr__(self, "efficiency", share)
        if self._turned and np.ndim(self.impulse_bit):
            raise ArgumentError("impulse_bit", np.asarray(self.impulse_bit).tolist(), "must be a number by norm")

    def check(self, n_controls: int, period: float) -> None:
        """Raise ArgumentError unless the limit fits a plant with m controls, and gives a bit in a period."""
        if self.saturation is None:
            return
        self.saturation.check(n_controls)
        if (np.asarray(self.impulse_bit) > period * self.saturation.limit.min()).any():
            allowed = f"must be at most what the thrusters give in a period, {period * self.saturation.limit.min():g}"
            raise ArgumentError("impulse_bit", np.asarray(self.impulse_bit).tolist(), allowed)

    def __call__(self, demand: Floats, period: float) -> tuple[Floats, Booleans]:
        """Return the controls that come of demands, and which are at a limit, (b, m) each."""
        control = np.where(np.abs(demand) < self.deadband, 0.0, demand)
        limited = np.zeros(demand.shape, dtype=bool)
        if self.saturation is not None:
            cut = self.saturation(control)
            limited = cut != control
            control = cut
        least = np.asarray(self.impulse_bit) / period
        if least.any():
            size = np.linalg.norm(control, axis=1, keepdims=True) if self._turned else np.abs(control)
            fired = np.where(size < 0.5 * least, 0.0, least / np.where(size > 0.0, size, 1.0))
            control = control * np.where(size < least, fired, 1.0)
        return control * np.reshape(self.efficiency, (-1, 1)), limited

    @property
    def _turned(self) -> bool:
        return self.saturation is not None and self.saturation.by == "norm"
