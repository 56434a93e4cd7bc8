"""SciPy's LSODA and BDF on a tether under FDA-SMC, the memory as modes that are states like the others."""

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
    """Tethers under FDA-SMC, one after the other; plant, law and modes are one compiled right-hand side.

    Args:
        method: ``LSODA`` or ``BDF``.
        tolerance: relative and absolute, but for the memory's kernel, which has the same relative error.
    """

    package = "scipy"

    def __init__(self, method: str, tolerance: float) -> None:
        self.method, self.tolerance = method, tolerance
        self.setting = f"{method}, tolerance {tolerance:.0e}"

    def __call__(self, starts: Floats, times: Floats) -> Floats:
        """Return [λ, θ, φ, λ', θ', φ'] at times (t,) from starts (r, 6), (r, t, 6)."""
        return np.array([self._one(start, times) for start in starts])

    def _one(self, start: Floats, times: Floats) -> Floats:
        rates, first = equations(start, float(times[-1]), self.tolerance)
        options: dict[str, Any] = {"rtol": self.tolerance, "atol": self.tolerance, "first_step": 1e-10}
        found = solve_ivp(rates, (0.0, float(times[-1])), first, self.method, t_eval=times, **options)
        if not found.success:
            raise RuntimeError(f"{self.setting}: {found.message}")
        return found.y[:6].T


def equations(start: Floats, horizon: float, tolerance: float) -> tuple[Callable[[float, Floats], Floats], Floats]:
    """Return the right-hand side over [q, q', I, ∫‖S‖, ∫‖S‖², φ] and the initial values."""
    plant, law = Tether(), AdaptiveSlidingMode()
    kernel = sum_of_exponentials(0.5, _SHORTEST, horizon, max(tolerance, 1e-13))
    parameters, numbers = plant.kernel_parameters(1)[0], law.numbers(plant, 1)[0]
    wanted = law.reference(np.zeros(1))[0][0]
    weights = kernel.weights[0] if kernel.weights.ndim == 2 else kernel.weights
    error = start[:3] - wanted
    first = np.concatenate([start, np.zeros(5), np.repeat(error, len(kernel.rates))])
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
