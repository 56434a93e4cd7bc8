"""Periodic orbits of free plants, by shooting, and the motion near them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from fracctl.arrays import Array, Complexes, Floats, finite
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop
from fracctl.plants.state import StatePlant
from fracctl.solvers.method_of_steps.solver import MethodOfSteps
from fracctl.stepwise import StepwiseTrajectory

_ITERATIONS = 30
_RTOL, _ATOL = 1e-12, 1e-13


@dataclass(frozen=True)
class PeriodicOrbit:
    """A free motion of a plant that repeats itself, from time 0 on."""

    plant: StatePlant
    state: Floats
    """x(0), (n,)."""
    period: float
    """T."""
    steps: int = 200
    """Steps of the method of steps in T."""

    @cached_property
    def trajectory(self) -> StepwiseTrajectory:
        """The free motion over one period."""
        count = max(8, int(np.ceil(self.steps * 2.0 * np.pi / self.period)))
        return MethodOfSteps(count).solve(ClosedLoop(self.plant), self.state, self.period)

    @property
    def gap(self) -> Floats:
        """x(T) - x(0), (n,)."""
        gap: Floats = self.trajectory([self.period])[0] - self.state
        return gap

    def jacobians(self, times: Floats) -> tuple[Floats, Floats]:
        """Return A = ∂f/∂x, (t, n, n), and B = ∂f/∂u, (t, n, m), on the orbit at times (t,) in [0, T]."""
        states = self.trajectory(times)
        return self.plant.jacobians(times, states, np.zeros((len(times), self.plant.n_controls)))

    def transition(self, gain: Callable[[float], Complexes] | None = None) -> Complexes:
        """Return Φ(T), (n, n), of y' = (A - B G(t)) y with a perhaps complex gain G, (m, n); None for free."""
        start = np.eye(self.plant.n_states, dtype=np.float64 if gain is None else np.complex128)
        return np.asarray(self._linear(start, np.array([self.period]), gain)[0], dtype=np.complex128)

    def motions(self, start: Floats, times: Floats) -> Floats:
        """Return the solutions of y' = A y at times (t,) from y(0) = start, (n, q), as (t, n, q)."""
        return self._linear(start, times)

    def _linear(self, start: Array, times: Floats, gain: Callable[[float], Complexes] | None = None) -> Array:
        def rates(t: float, y: Array) -> Array:
            a, b = self.jacobians(np.array([t]))
            matrix = a[0] if gain is None else a[0] - b[0] @ gain(t)
            rate: Array = (matrix @ y.reshape(start.shape)).ravel()
            return rate

        span = (0.0, self.period)
        run = solve_ivp(rates, span, start.ravel(), method="DOP853", t_eval=times, rtol=_RTOL, atol=_ATOL)
        shape = (len(times), *start.shape)
        return np.asarray(run.y).T.reshape(shape) if run.success else np.full(shape, np.nan)


def shoot(
    plant: StatePlant, guess: ArrayLike, period: float, steps: int = 200, tolerance: float = 1e-12
) -> PeriodicOrbit:
    """Return the orbit of a given period nearest to a guess, by Newton's method with corrections of least norm.

    Args:
        plant: the plant; where it depends on time, T must be a multiple of its period.
        guess: x(0), (n,).
        period: T.
        steps: of the method of steps in T.
        tolerance: of |x(T) - x(0)| over 1 + |x(0)|.

    Raises:
        ArgumentError: the iteration does not converge; a better guess is wanted.
    """
    state = finite("guess", guess)
    identity = np.eye(plant.n_states)
    for _ in range(_ITERATIONS):
        orbit = PeriodicOrbit(plant, state, period, steps)
        gap = orbit.gap
        if not np.isfinite(gap).all():
            break
        if np.linalg.norm(gap) <= tolerance * (1.0 + np.linalg.norm(state)):
            return orbit
        state = state - np.linalg.lstsq(orbit.transition().real - identity, gap, rcond=1e-9)[0]
    raise ArgumentError("guess", np.asarray(guess).tolist(), f"must lie near an orbit of period {period:g}")
