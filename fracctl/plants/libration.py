"""Planar libration of a body on an elliptic orbit."""

from __future__ import annotations

import math

import numpy as np

from fracctl.arrays import Floats
from fracctl.compiling import compiled_with
from fracctl.errors import ArgumentError
from fracctl.plants.state import SecondOrder


class Libration(SecondOrder):
    """The angle φ of a body to the local vertical, as a function of the true anomaly ν.

        φ'' = [2e sin ν (1 + φ') - K sin 2φ]/(1 + e cos ν) - c φ'² - γ φ'/(1 + e cos ν)² + υ

    (Biggs, McInnes, Eq. 4.) The angle is in radians and is not wrapped; the independent variable is ν in radians.

    Args:
        eccentricity: e in [0, 1).
        inertia: K, of the moments of inertia.
        drag: c, of the term in φ'².
        damping: γ, of the term in φ'.

    Raises:
        ArgumentError: a number is not finite, or the orbit is not an ellipse.
    """

    components = ("phi",)
    angles = ("phi",)
    scales = None
    period = 2.0 * math.pi

    def __init__(
        self, eccentricity: float = 0.2, inertia: float = 0.75, drag: float = 0.04, damping: float = 0.05
    ) -> None:
        if not 0.0 <= eccentricity < 1.0:
            raise ArgumentError("eccentricity", eccentricity, "must lie in [0, 1)")
        for name, value in (("inertia", inertia), ("drag", drag), ("damping", damping)):
            if not math.isfinite(value):
                raise ArgumentError(name, value, "must be a finite number")
        self.eccentricity, self.inertia, self.drag, self.damping = map(float, (eccentricity, inertia, drag, damping))

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return x' of x = [φ, φ'], (b, 2)."""
        return _rates(t, x, u, self.eccentricity, self.inertia, self.drag, self.damping)

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, 2, 2), and ∂f/∂u, (b, 2, 1)."""
        radius = 1.0 + self.eccentricity * np.cos(t)
        state, control = np.zeros((len(x), 2, 2)), np.zeros((len(x), 2, u.shape[1]))
        state[:, 0, 1] = control[:, 1, 0] = 1.0
        state[:, 1, 0] = -2.0 * self.inertia * np.cos(2.0 * x[:, 0]) / radius
        state[:, 1, 1] = 2.0 * self.eccentricity * np.sin(t) / radius - 2.0 * self.drag * x[:, 1]
        state[:, 1, 1] -= self.damping / radius**2
        return state, control


@compiled_with(error_model="numpy")
def _rates(t: Floats, x: Floats, u: Floats, e: float, inertia: float, drag: float, damping: float) -> Floats:
    out = np.empty_like(x)
    for i in range(len(x)):
        angle, rate = x[i, 0], x[i, 1]
        radius = 1.0 + e * math.cos(t[i])
        gravity = (2.0 * e * math.sin(t[i]) * (1.0 + rate) - inertia * math.sin(2.0 * angle)) / radius
        out[i, 0] = rate
        out[i, 1] = gravity - drag * rate * rate - damping * rate / (radius * radius) + u[i, 0]
    return out
