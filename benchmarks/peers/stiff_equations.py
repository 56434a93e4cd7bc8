"""SciPy's LSODA and BDF on a tether under FDA-SMC, the memory as modes that are states like the others.

The right-hand side is this project's compiled plant and law, or the same written with NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fracctl.compiling import ACCELERATION, DEMAND
from fracctl.controllers import AdaptiveSlidingMode
from fracctl.fractional.sum_of_exponentials import sum_of_exponentials
from fracctl.plants import Tether

Floats = NDArray[np.float64]

_SHORTEST = 1e-10
"""From there on the kernel of the modes is as good as its bound; before, singular kernels are cut off."""
_SHORT = 1e-7
"""Step in which the law's auxiliary states tell their rates."""


class SciPy:
    """Tethers under FDA-SMC, one after the other; plant, law and modes are one right-hand side.

    Args:
        method: ``LSODA`` or ``BDF``.
        tolerance: relative and absolute, but for the memory's kernel, which has the same relative error.
        compiled: whether the right-hand side is.
    """

    package = "scipy"

    def __init__(self, method: str, tolerance: float, compiled: bool = True) -> None:
        self.method, self.tolerance, self.compiled = method, tolerance, compiled
        self.setting = f"{method}, tolerance {tolerance:.0e}" + ("" if compiled else ", NumPy")

    def __call__(self, starts: Floats, times: Floats) -> Floats:
        """Return [λ, θ, φ, λ', θ', φ'] at times (t,) from starts (r, 6), (r, t, 6)."""
        return np.array([self._one(start, times) for start in starts])

    def _one(self, start: Floats, times: Floats) -> Floats:
        rates, first = equations(start, float(times[-1]), self.tolerance, self.compiled)
        options: dict[str, Any] = {"rtol": self.tolerance, "atol": self.tolerance, "first_step": 1e-10}
        found = solve_ivp(rates, (0.0, float(times[-1])), first, self.method, t_eval=times, **options)
        if not found.success:
            raise RuntimeError(f"{self.setting}: {found.message}")
        return found.y[:6].T


def equations(
    start: Floats, horizon: float, tolerance: float, compiled: bool = True
) -> tuple[Callable[[float, Floats], Floats], Floats]:
    """Return the right-hand side over [q, q', I, ∫‖S‖, ∫‖S‖², φ] and the initial values."""
    plant, law = Tether(), AdaptiveSlidingMode()
    kernel = sum_of_exponentials(0.5, _SHORTEST, horizon, max(tolerance, 1e-13))
    parameters, numbers = plant.kernel_parameters(1)[0], law.numbers(plant, 1)[0]
    wanted = law.reference(np.zeros(1))[0][0]
    weights = kernel.weights[0] if kernel.weights.ndim == 2 else kernel.weights
    error = start[:3] - wanted
    first = np.concatenate([start, np.zeros(5), np.repeat(error, len(kernel.rates))])
    if not compiled:
        return _written(plant, law, kernel.rates, weights, wanted), first
    limits, right_hand_side = plant.limits[0], _compiled()
    given = (plant.acceleration, law.demand, parameters, numbers, wanted, kernel.rates, weights, limits)
    return lambda t, y: right_hand_side(t, np.ascontiguousarray(y), *given), first


@cache
def _compiled() -> Any:
    @numba.njit(error_model="numpy")
    def rates(
        t: float,
        y: Floats,
        acceleration: numba.types.FunctionType(ACCELERATION),  # type: ignore[valid-type]
        demand: numba.types.FunctionType(DEMAND),  # type: ignore[valid-type]
        plant: Floats,
        law: Floats,
        wanted: Floats,
        modes: Floats,
        weights: Floats,
        limits: Floats,
    ) -> Floats:
        out = np.empty_like(y)
        count = len(modes)
        fractional = np.zeros(3)
        for i in range(3):
            for j in range(count):
                mode = y[11 + i * count + j]
                fractional[i] += weights[j] * mode
                out[11 + i * count + j] = y[3 + i] - modes[j] * mode
        z, ahead = np.empty(5), np.empty(5)
        asked, second = np.empty(3), np.empty(3)
        q, v, error, kept, most = y[:3], y[3:6], y[:3] - wanted, y[6:11], np.zeros(5)
        demand(t, q, v, error, v, fractional, _SHORT, kept, most, law, ahead, asked)
        demand(t, q, v, error, v, fractional, 0.0, kept, most, law, z, asked)
        for k in range(5):
            out[6 + k] = (ahead[k] - z[k]) / _SHORT
        for i in range(3):
            asked[i] = min(max(asked[i], -limits[i]), limits[i])
        acceleration(t, q, v, asked, plant, second)
        for i in range(3):
            out[i], out[3 + i] = y[3 + i], second[i]
        return out

    return rates


def _written(
    plant: Tether, law: AdaptiveSlidingMode, modes: Floats, weights: Floats, wanted: Floats
) -> Callable[[float, Floats], Floats]:
    """Return the right-hand side as one writes it with NumPy, with the paper's numbers."""
    e, rho, *_ = plant.kernel_parameters(1)[0]
    limits, gamma, amplitude = plant.limits[0], law.gamma, 0.05

    def rates(t: float, y: Floats) -> Floats:
        q, v, integral, driven = y[:3], y[3:6], y[6:9], y[9:11]
        memory = y[11:].reshape(3, -1)
        error = q - wanted
        x = v + 1.75 * error + 0.5 * (memory @ weights)
        soft = np.where(np.abs(x) < np.pi / 2, np.sin(x), np.sign(x))
        wound = gamma * integral
        second = x + np.arcsin(wound)
        first, other = law.adapted(np.concatenate([integral, driven])[None])[0]
        asked = -(6.0 * first * np.clip((soft + wound) / 0.05, -1.0, 1.0) + 0.0162 * other * second)
        u = np.clip(asked, -limits, limits) + amplitude * np.sin(t)
        k = 1.0 + e * np.cos(t)
        b = 2.0 * e * np.sin(t) / k
        (length, theta, phi), (rate, turn, swing) = q, v
        cos, across = np.cos(phi), np.cos(theta)
        pull = length * (swing**2 + (turn + 1.0) ** 2 * cos**2) - length / k * (1.0 - 3.0 * across**2 * cos**2)
        along = (turn + 1.0) * (b - 2.0 * rate / length + 2.0 * np.tan(phi) * swing)
        acceleration = [
            u[0] - rho + b * rate + pull,
            u[1] / (length * cos) ** 2 + along - 3.0 / k * np.sin(theta) * across,
            u[2] / length**2
            + (b - 2.0 * rate / length) * swing
            - ((turn + 1.0) ** 2 + 3.0 / k * across**2) * np.sin(phi) * cos,
        ]
        kept = v[:, None] - modes * memory
        return np.concatenate([v, acceleration, soft, [np.abs(second).sum(), (second**2).sum()], kept.ravel()])

    return rates
