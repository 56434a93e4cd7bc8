"""What trajectories are compared with: never the solver's own, and checked by two methods against each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from fracctl.arrays import Floats
from fracctl.errors import FracctlError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop
from fracctl.solvers import Contour, Volterra
from fracctl.trajectory import Trajectory

SAMPLES = 401
"""Times of comparison, uniform from 0 to the horizon."""
AGREEMENT = 1e-9
"""Difference of the references relative to the peak, above which nothing is compared with them."""


@dataclass(frozen=True)
class Samples:
    """Positions and controls at the times of comparison, each (SAMPLES, m)."""

    positions: Floats
    controls: Floats

    def errors_of(self, other: Samples) -> tuple[float, float]:
        """Return the largest difference of positions and of controls over the peaks of these."""
        position = _relative(self.positions, other.positions)
        return position, _relative(self.controls, other.controls)


class References:
    """One loop's trajectory by the contour and the Volterra solver at their tightest, and the matrix exponential.

    Args:
        loop: a single one.
        state: initial state, (2m,).
        horizon: last time.

    Raises:
        FracctlError: the references disagree.
    """

    def __init__(self, loop: ClosedLoop, state: Floats, horizon: float) -> None:
        self.times = np.linspace(0.0, horizon, SAMPLES)
        self._contour = self.samples(Contour(1e-11).solve(loop, state, horizon))
        self._volterra = self.samples(Volterra(64, tolerance=1e-11).solve(loop, state, horizon))
        self._exact = matrix_exponential(loop.system, state, self.times)
        pairs = [(self._contour, self._volterra)]
        pairs += [(self._exact, self._contour)] if self._exact is not None else []
        self.disagreement = max(max(first.errors_of(second)) for first, second in pairs)
        """Largest difference between references relative to the peak."""
        if not self.disagreement <= AGREEMENT:
            raise FracctlError(f"the reference trajectories disagree by {self.disagreement:.1e} of the peak")

    def samples(self, trajectory: Trajectory) -> Samples:
        """Return a trajectory of one loop at the times of comparison."""
        m = trajectory.positions.shape[1]
        return Samples(trajectory(self.times)[:, :m], trajectory.control(self.times))

    def independent_of(self, solver: str) -> Samples:
        """Return the matrix exponential where there is one, else what another solver computed."""
        if self._exact is not None:
            return self._exact
        return self._volterra if solver == Contour.name else self._contour


def matrix_exponential(system: LinearFractionalSystem, state: Floats, times: Floats) -> Samples | None:
    """Return the solution of a loop of integer order at uniform times; None where an order is not 0 or 1."""
    m = system.n_positions
    if system.n_auxiliary or any(set(term.orders.tolist()) - {0.0, 1.0} for term in system.dynamics[1:]):
        return None
    feedback = np.concatenate([_coefficients(system.control, m, order) for order in (0.0, 1.0)], axis=1)
    lower = np.concatenate([-_coefficients(system.dynamics[1:], m, order) for order in (0.0, 1.0)], axis=1)
    step = expm(np.concatenate([np.eye(m, 2 * m, m), lower]) * (times[1] - times[0]))
    states = np.empty((times.size, 2 * m))
    states[0] = state
    for i in range(1, times.size):
        states[i] = step @ states[i - 1]
    return Samples(states[:, :m], states @ feedback.T)


def _coefficients(terms: tuple[FractionalTerm, ...], m: int, order: float) -> Floats:
    """Return the sum of the matrices' columns of one order, (m, m)."""
    total: Floats = sum((term.matrix * (term.orders == order) for term in terms), np.zeros((m, m)))
    return total


def _relative(reference: Floats, values: Floats) -> float:
    return float(np.abs(values - reference).max() / np.abs(reference).max())
