"""Equatorial motion about a uniformly rotating ellipsoidal body, in the frame that turns with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from fracctl.arrays import Floats, positive
from fracctl.compiling import compiled_with
from fracctl.errors import ArgumentError
from fracctl.plants.state import Event, SecondOrder, Section
from fracctl.units import Scales

EROS_GRAVITATIONAL_PARAMETER_KM3_S2 = 4.463e-4
"""GM of 433 Eros, from the orbit of NEAR Shoemaker."""
EROS_ROTATION_PERIOD_H = 5.27025
"""Sidereal period of 433 Eros in hours."""
EROS_SEMI_AXES_KM = (17.2, 5.6)
"""Half lengths of an ellipsoid about 433 Eros in its equatorial plane."""


class RotatingEllipsoid(SecondOrder):
    """A particle in the equatorial plane of a body that turns at a constant rate, with the C₂₂ term of its gravity.

        x'' - 2y' = ∂V/∂x + υ_x,    y'' + 2x' = ∂V/∂y + υ_y,    V = 1/r + r²/2 + 3 C₂₂ (x² - y²)/r⁵

    (Biggs, McInnes.) x lies along the body's long axis; lengths over (GM/Ω²)^⅓, time over 1/Ω. Events: ``collision``
    where r < `collision_radius`, ``escaped`` where r > `escape_radius`, and ``body_entry``, the body's surface.

    Args:
        c22: C₂₂, over the square of the unit of length.
        gravitational_parameter_km3_s2: GM of the body in km³/s².
        rotation_period_h: 2π/Ω in hours.
        semi_axes_km: half lengths of the body along x and y in km.
        collision: what ends a run: ``point`` for the collision radius alone, ``body`` for the surface too.
        collision_radius: dimensionless.
        escape_radius: dimensionless.

    Raises:
        ArgumentError: a number is not positive (C₂₂: not finite), or `collision` is another word.
    """

    components = ("x", "y")

    def __init__(
        self,
        c22: float = 0.052,
        gravitational_parameter_km3_s2: float = EROS_GRAVITATIONAL_PARAMETER_KM3_S2,
        rotation_period_h: float = EROS_ROTATION_PERIOD_H,
        semi_axes_km: Sequence[float] = EROS_SEMI_AXES_KM,
        collision: Literal["point", "body"] = "point",
        collision_radius: float = 0.02,
        escape_radius: float = 5.0,
    ) -> None:
        if not math.isfinite(c22):
            raise ArgumentError("c22", c22, "must be a finite number")
        if collision not in ("point", "body"):
            raise ArgumentError("collision", repr(collision), "must be 'point' or 'body'")
        if len(semi_axes_km) != 2:
            raise ArgumentError("semi_axes_km", semi_axes_km, "must be two numbers, along x and y")
        given = {
            "gravitational_parameter_km3_s2": gravitational_parameter_km3_s2,
            "rotation_period_h": rotation_period_h,
            "semi_axes_km": min(semi_axes_km),
            "collision_radius": collision_radius,
            "escape_radius": escape_radius,
        }
        for name, value in given.items():
            positive(name, value)
        self.c22, self.collision = float(c22), collision
        time = 3600.0 * rotation_period_h / (2.0 * math.pi)
        length_km = (gravitational_parameter_km3_s2 * time**2) ** (1.0 / 3.0)
        self.scales = Scales(length_m=1e3 * length_km, time_s=time)
        self.semi_axes = tuple(axis / length_km for axis in semi_axes_km)
        self.collision_radius, self.escape_radius = float(collision_radius), float(escape_radius)

    @property
    def events(self) -> tuple[Event, ...]:
        """Collision and escape, and the entry into the body."""
        a, b = self.semi_axes
        return (
            Event("collision", lambda _, x: np.hypot(x[:, 0], x[:, 1]) - self.collision_radius),
            Event("escaped", lambda _, x: self.escape_radius - np.hypot(x[:, 0], x[:, 1])),
            Event("body_entry", lambda _, x: np.hypot(x[:, 0] / a, x[:, 1] / b) - 1.0, self.collision == "body"),
        )

    @property
    def section(self) -> Section:
        """x = 0 with y > 0, where the paper's orbits begin."""
        return Section(lambda _, x: x[:, 0], lambda _, x: x[:, 1])

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return x' of x = [x, y, x', y'], (b, 4)."""
        del t
        return _rates(x, u, self.c22)

    def potential(self, x: Floats) -> Floats:
        """Return V at positions x (…, ≥ 2), (…)."""
        square = x[..., 0] ** 2 + x[..., 1] ** 2
        oblate = 3.0 * self.c22 * (x[..., 0] ** 2 - x[..., 1] ** 2) / square**2.5
        value: Floats = square**-0.5 + 0.5 * square + oblate
        return value

    def jacobi_constant(self, x: Floats) -> Floats:
        """Return the integral 2V - x'² - y'² of the free motion at states (…, 4), (…)."""
        value: Floats = 2.0 * self.potential(x) - x[..., 2] ** 2 - x[..., 3] ** 2
        return value

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, 4, 4), and ∂f/∂u, (b, 4, 2)."""
        del t
        px, py = x[:, 0], x[:, 1]
        s = px**2 + py**2
        difference = px**2 - py**2
        state, control = np.zeros((len(x), 4, 4)), np.zeros((len(x), 4, u.shape[1]))
        state[:, 0, 2] = state[:, 1, 3] = control[:, 2, 0] = control[:, 3, 1] = 1.0
        state[:, 2, 3], state[:, 3, 2] = 2.0, -2.0
        for i, j, sign in ((0, 0, 1.0), (1, 1, -1.0)):
            p = x[:, i]
            central = 1.0 - s**-1.5 + 3.0 * p**2 * s**-2.5
            term = sign * (2.0 * s**-2.5 - 20.0 * p**2 * s**-3.5) + difference * (35.0 * p**2 / s - 5.0) * s**-3.5
            state[:, 2 + i, j] = central + 3.0 * self.c22 * term
        state[:, 2, 1] = 3.0 * px * py * s**-2.5 + 105.0 * self.c22 * px * py * difference * s**-4.5
        state[:, 3, 0] = state[:, 2, 1]
        return state, control


@compiled_with(error_model="numpy")
def _rates(x: Floats, u: Floats, c22: float) -> Floats:
    out = np.empty_like(x)
    for i in range(len(x)):
        px, py = x[i, 0], x[i, 1]
        inverse = 1.0 / (px * px + py * py)
        cube = inverse * math.sqrt(inverse)
        shape = 3.0 * c22 * cube * inverse
        common = 1.0 - cube - 5.0 * shape * (px * px - py * py) * inverse
        out[i, 0] = x[i, 2]
        out[i, 1] = x[i, 3]
        out[i, 2] = 2.0 * x[i, 3] + px * (common + 2.0 * shape) + u[i, 0]
        out[i, 3] = -2.0 * x[i, 2] + py * (common - 2.0 * shape) + u[i, 1]
    return out
