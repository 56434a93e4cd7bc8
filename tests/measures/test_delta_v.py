"""ΔV of delayed feedback against closed forms and against values computed independently of this project."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import DelayedFeedback
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop
from fracctl.measures import delta_v
from fracctl.plants import FunctionPlant, RotatingEllipsoid
from fracctl.solvers import MethodOfSteps
from fracctl.stepwise import StepwiseTrajectory


def drift(gains: list[list[list[float]]], horizon: float) -> StepwiseTrajectory:
    """x = (3t, 4t) whatever is done; u = -K (3τ, 4τ) from τ on."""
    plant = FunctionPlant(lambda t, x, u: 0.0 * x + [3.0, 4.0], 2, 2)
    return MethodOfSteps(10).solve(ClosedLoop(plant, DelayedFeedback(gains, 2.0)), [0.0, 0.0], horizon)


def test_constant_thrust() -> None:
    """|u| = 10 k from t = 2; nothing before."""
    whole = drift([np.eye(2), 0.5 * np.eye(2)], 7.0)
    np.testing.assert_allclose(delta_v(whole), [50.0, 25.0], rtol=1e-13)
    np.testing.assert_allclose(delta_v(whole, [0.0, 3.0], [2.0, 4.5]), [0.0, 7.5], atol=1e-12)
    assert delta_v(drift(np.eye(2), 7.0), 1.0, 3.3) == pytest.approx(13.0, rel=1e-13)


# ρ, τ of the first return, gains, ΔV in m/s an orbit averaged over the first 20 controlled orbits
A, B = (0.0525, -0.1243, 0.1169, 0.0373), (0.0155, -0.0579, 0.0123, 0.0126)
EROS = [
    (1.632, 3.06311, B, 0.137),
    (1.75, 2.59471, A, 0.266),
    (1.9, 3.10656, A, 0.016),
    (2.1, 3.83577, A, 0.36),
    (2.2, 4.05965, A, 0.30),
    (2.3, 4.21213, A, 0.76),
]


def test_controlled_orbits_about_eros() -> None:
    """All six orbits in one batch, each with its own delay and gains; within 5 % of the listed ΔV."""
    rho, tau = (np.array([row[i] for row in EROS]) for i in (0, 1))
    gains = np.array([[[a, b, c, d], [-b, a, -d, c]] for _, _, (a, b, c, d), _ in EROS])
    starts = np.stack([0 * rho, 1 + 0 * rho, rho, 0 * rho], axis=1)
    loop = ClosedLoop(RotatingEllipsoid(), DelayedFeedback(gains, tau))
    trajectory = MethodOfSteps().solve(loop, starts, 21.0 * tau.max())
    assert list(trajectory.status) == ["ok"] * 6
    spent = delta_v(trajectory, tau, 21.0 * tau) / 20.0 * RotatingEllipsoid().scales.speed_m_s
    np.testing.assert_allclose(spent, [row[3] for row in EROS], rtol=0.05)
    last = np.linalg.norm(trajectory.control(21.0 * tau[:, None])[:, 0], axis=1)
    first = np.linalg.norm(trajectory.control(1.5 * tau[:, None])[:, 0], axis=1)
    assert np.all(last < 0.2 * first)


def test_intervals_outside_the_horizon_are_refused() -> None:
    with pytest.raises(ArgumentError, match=r"`stop` must lie in \[0, 7\], the solved horizon, but is 8.0"):
        delta_v(drift(np.eye(2), 7.0), 0.0, 8.0)
