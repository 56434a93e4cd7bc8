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

    What a spacecraft then feels is `efficiency` times that: thrust off its nominal value, a mass that is not the one
    the law takes it for.

    A thruster of fixed thrust gives the impulse u_i T_s by its pulse width; it cannot fire shorter than its minimum
    impulse bit. The impulse counts as spread evenly over the period, which changes positions by a F T_s²/8 at most for
    a thruster of acceleration a F.

    Args:
        saturation: `fracctl.controllers.Saturation`; None for no limit.
        deadband: () or (m,), accelerations over the plant's scale.
        impulse_bit: () or (m,), velocities over the plant's scale.
        efficiency: acceleration given over that asked for, () or (b,), of all axes.

    Raises:
        ArgumentError: a number is negative, or an efficiency not positive.
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

    def __call__(self, demand: Floats, period: float) -> tuple[Floats, Booleans]:
        """Return the controls (b, m) that come of demands, and who is at a limit, (b,)."""
        control = np.where(np.abs(demand) < self.deadband, 0.0, demand)
        limited = np.zeros(len(demand), dtype=bool)
        if self.saturation is not None:
            cut = self.saturation(control)
            limited = (cut != control).any(axis=1)
            control = cut
        least = np.asarray(self.impulse_bit) / period
        if least.any():
            size = np.abs(control)
            control = np.where(size < least, np.where(size < 0.5 * least, 0.0, np.copysign(least, control)), control)
        return control * np.reshape(self.efficiency, (-1, 1)), limited
