"""Linearised motion relative to a leader on an elliptic orbit."""

from __future__ import annotations

from typing import Literal

import numpy as np

from fracctl.arrays import Floats
from fracctl.plants.relative_motion import AboutKeplerOrbit


class TschaunerHempel(AboutKeplerOrbit):
    """The linearisation of `RelativeMotion` about the leader: the equations of Tschauner and Hempel, frame `rtn`.

        x'' = 2ωy' + ω'y + (ω² + 2/r³) x + υ_x,    y'' = -2ωx' - ω'x + (ω² - 1/r³) y + υ_y,    z'' = -z/r³ + υ_z

    The independent variable is time over 1/n, as in the nonlinear plant, so that both fly under one law with the same
    memory: D^α with respect to the true anomaly would be another law. Linear, with coefficients of period 2π; with
    e = 0 the Hill-Clohessy-Wiltshire equations.

    Args:
        leader: the orbit's semi-major axis and the gravitational parameter; its angles matter to orbit elements only.
        eccentricity: e in [0, 1).
        true_anomaly_deg: of the leader at time 0, in degrees; 0 at perigee.

    Raises:
        ArgumentError: the orbit is not an ellipse, or a number is not finite.
    """

    linear: Literal[True] = True
    """In states and controls, with coefficients of the orbit's period."""

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return x' of x = [x, y, z, x', y', z'], (b, 6)."""
        r, omega, omega_dot = self.leader_motion(t).T
        pull, square = 1.0 / r**3, omega**2
        out = np.empty_like(x)
        out[:, :3] = x[:, 3:]
        out[:, 3] = 2.0 * omega * x[:, 4] + omega_dot * x[:, 1] + (square + 2.0 * pull) * x[:, 0] + u[:, 0]
        out[:, 4] = -2.0 * omega * x[:, 3] - omega_dot * x[:, 0] + (square - pull) * x[:, 1] + u[:, 1]
        out[:, 5] = -pull * x[:, 2] + u[:, 2]
        return out

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, 6, 6), and ∂f/∂u, (b, 6, 3), which depend on t alone."""
        r, omega, omega_dot = self.leader_motion(t).T
        state, control = np.zeros((len(x), 6, 6)), np.zeros((len(x), 6, u.shape[1]))
        state[:, :3, 3:] = control[:, 3:] = np.eye(3)
        pull, square = 1.0 / r**3, omega**2
        state[:, 3, 0], state[:, 4, 1], state[:, 5, 2] = square + 2.0 * pull, square - pull, -pull
        state[:, 3, 1], state[:, 4, 0] = omega_dot, -omega_dot
        state[:, 3, 4], state[:, 4, 3] = 2.0 * omega, -2.0 * omega
        return state, control
