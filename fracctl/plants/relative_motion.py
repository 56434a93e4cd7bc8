"""Nonlinear motion relative to a leader on a Kepler orbit."""

from __future__ import annotations

import copy
import math
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite
from fracctl.compiling import compiled_with
from fracctl.elements import Elements
from fracctl.errors import ArgumentError
from fracctl.plants.capabilities import of_rows
from fracctl.plants.hcw import Chief
from fracctl.plants.state import SecondOrder


class AboutKeplerOrbit(SecondOrder):
    """What plants about a leader on a Kepler orbit share: the orbit, and where the leader is on it.

    Args:
        leader: the orbit's semi-major axis and the gravitational parameter; its angles matter to orbit elements only.
        eccentricity: e in [0, 1).
        true_anomaly_deg: of the leader at time 0, in degrees; 0 at perigee.

    Raises:
        ArgumentError: the orbit is not an ellipse, or a number is not finite.
    """

    components = ("x", "y", "z")
    period = 2.0 * math.pi
    dispersed = ("eccentricity", "true_anomaly_deg")
    """What `dispersed_by` takes."""

    def __init__(self, leader: Chief | None = None, eccentricity: float = 0.0, true_anomaly_deg: float = 0.0) -> None:
        self.eccentricity, self.true_anomaly_deg = checked_phase(eccentricity, true_anomaly_deg)
        self.leader = leader or Chief(semi_major_axis_km=6700.0)
        self.scales = self.leader.scales
        self._e = np.array([self.eccentricity])
        self._mean_anomaly = np.array([mean_anomaly(self.eccentricity, math.radians(self.true_anomaly_deg))])

    @property
    def chief_elements(self) -> Elements:
        """Those of the leader at time 0."""
        return self.leader.elements(self.eccentricity, self.true_anomaly_deg)

    def leader_motion(self, t: Floats) -> Floats:
        """Return r, ω and ω' at times (b,), (b, 3).

        Raises:
            ArgumentError: the times are not as many as leaders.
        """
        return kepler_motion(t + of_rows(self._mean_anomaly, len(t)), of_rows(self._e, len(t)))

    @property
    def batch(self) -> int | None:
        """Batch size, None where all members share the leader."""
        return len(self._e) if len(self._e) > 1 else None

    def take(self, rows: Array) -> Self:
        """Return the plant of some members."""
        if self.batch is None:
            return self
        other = copy.copy(self)
        other._e, other._mean_anomaly = self._e[rows], self._mean_anomaly[rows]
        return other

    def dispersed_by(self, eccentricity: ArrayLike | None = None, true_anomaly_deg: ArrayLike | None = None) -> Self:
        """Return the plant of b members, each about a leader of its own; what is not given is as it was.

        Args:
            eccentricity: e in [0, 1), (b,).
            true_anomaly_deg: of the leaders at time 0, (b,).

        Raises:
            ArgumentError: an orbit is not an ellipse.
        """
        e = finite("eccentricity", self.eccentricity if eccentricity is None else eccentricity)
        anomalies = finite("true_anomaly_deg", self.true_anomaly_deg if true_anomaly_deg is None else true_anomaly_deg)
        pairs = [checked_phase(float(one), float(other)) for one, other in np.broadcast(*np.atleast_1d(e, anomalies))]
        other = copy.copy(self)
        other._e = np.array([e for e, _ in pairs])
        other._mean_anomaly = np.array([mean_anomaly(e, math.radians(anomaly)) for e, anomaly in pairs])
        return other


class RelativeMotion(AboutKeplerOrbit):
    """The position of a follower in the frame `rtn` of a leader on a circular or elliptic orbit, both point masses.

        x'' = 2ωy' + ω'y + ω²x + g_x + υ_x,    y'' = -2ωx' - ω'x + ω²y + g_y + υ_y,    z'' = g_z + υ_z

    with x radial outward, y along-track, z along the orbit normal, and the difference g of the two attractions, which
    is computed without cancellation:

        g = -[x - r f, y, z]/(r³ (1 + f)),    f = (1 + q)^{3/2} - 1 = q (3 + 3q + q²)/(1 + (1 + q)^{3/2}),
        q = (2rx + x² + y² + z²)/r²

    Lengths over the leader's semi-major axis a, time over 1/n. Its radius r and rate ω come from Kepler's equation.

    Args:
        leader: the orbit's semi-major axis and the gravitational parameter; its angles matter to orbit elements only.
        eccentricity: e in [0, 1).
        true_anomaly_deg: of the leader at time 0, in degrees; 0 at perigee.

    Raises:
        ArgumentError: the orbit is not an ellipse, or a number is not finite.
    """

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return x' of x = [x, y, z, x', y', z'], (b, 6)."""
        return _rates(self.leader_motion(t), x, u)

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, 6, 6), and ∂f/∂u, (b, 6, 3)."""
        r, omega, omega_dot = self.leader_motion(t).T
        place = x[:, :3] + r[:, None] * np.array([1.0, 0.0, 0.0])
        square = (place**2).sum(axis=1)
        state, control = np.zeros((len(x), 6, 6)), np.zeros((len(x), 6, u.shape[1]))
        state[:, :3, 3:] = control[:, 3:] = np.eye(3)
        outer = place[:, :, None] * place[:, None, :]
        state[:, 3:, :3] = (3.0 * outer / square[:, None, None] - np.eye(3)) * square[:, None, None] ** -1.5
        state[:, 3, 0] += omega**2
        state[:, 4, 1] += omega**2
        state[:, 3, 1] += omega_dot
        state[:, 4, 0] -= omega_dot
        state[:, 3, 4], state[:, 4, 3] = 2.0 * omega, -2.0 * omega
        return state, control


def checked_phase(eccentricity: float, true_anomaly_deg: float) -> tuple[float, float]:
    """Return both; raise ArgumentError unless the orbit is an ellipse and the angle a finite number."""
    if not 0.0 <= eccentricity < 1.0:
        raise ArgumentError("eccentricity", eccentricity, "must lie in [0, 1)")
    if not math.isfinite(true_anomaly_deg):
        raise ArgumentError("true_anomaly_deg", true_anomaly_deg, "must be a finite number")
    return float(eccentricity), float(true_anomaly_deg)


def mean_anomaly(eccentricity: float, true_anomaly: float) -> float:
    """Return M in rad of a true anomaly in rad, in the same turn."""
    half = 0.5 * math.remainder(true_anomaly, math.tau)
    e = eccentricity
    eccentric = 2.0 * math.atan2(math.sqrt(1.0 - e) * math.sin(half), math.sqrt(1.0 + e) * math.cos(half))
    return eccentric - e * math.sin(eccentric) + math.tau * round((true_anomaly - 2.0 * half) / math.tau)


@compiled_with(error_model="numpy")
def kepler_motion(t: Floats, eccentricity: Floats) -> Floats:
    """Return r, ω, ω' of Kepler orbits with a = n = 1 and e (b,) at times from perigee (b,), (b, 3)."""
    out = np.empty((len(t), 3))
    for i in range(len(t)):
        e = eccentricity[i]
        mean = t[i] - 2.0 * math.pi * math.floor(t[i] / (2.0 * math.pi) + 0.5)
        anomaly = mean + math.copysign(0.85 * e, mean)
        for _ in range(50):
            step = (anomaly - e * math.sin(anomaly) - mean) / (1.0 - e * math.cos(anomaly))
            anomaly -= step
            if abs(step) < 1e-15:
                break
        r = 1.0 - e * math.cos(anomaly)
        omega = math.sqrt(1.0 - e * e) / (r * r)
        out[i, 0] = r
        out[i, 1] = omega
        out[i, 2] = -2.0 * e * math.sin(anomaly) / r * omega / r
    return out


@compiled_with(error_model="numpy")
def _rates(leader: Floats, x: Floats, u: Floats) -> Floats:
    out = np.empty_like(x)
    for i in range(len(x)):
        r, omega, omega_dot = leader[i, 0], leader[i, 1], leader[i, 2]
        px, py, pz = x[i, 0], x[i, 1], x[i, 2]
        q = (2.0 * r * px + px * px + py * py + pz * pz) / (r * r)
        root = (1.0 + q) * math.sqrt(1.0 + q)
        f = q * (3.0 + q * (3.0 + q)) / (1.0 + root)
        pull = 1.0 / (r * r * r * root)
        out[i, 0], out[i, 1], out[i, 2] = x[i, 3], x[i, 4], x[i, 5]
        out[i, 3] = 2.0 * omega * x[i, 4] + omega_dot * py + omega * omega * px - pull * (px - r * f) + u[i, 0]
        out[i, 4] = -2.0 * omega * x[i, 3] - omega_dot * px + omega * omega * py - pull * py + u[i, 1]
        out[i, 5] = -pull * pz + u[i, 2]
    return out
