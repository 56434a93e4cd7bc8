"""Relative motion of two satellites that both feel the oblateness of the planet and the drag of its atmosphere."""

from __future__ import annotations

import copy
import math
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite
from fracctl.compiling import compiled_with
from fracctl.dispersions import check_names
from fracctl.elements import Elements
from fracctl.errors import ArgumentError
from fracctl.plants.capabilities import of_rows
from fracctl.plants.function import FunctionPlant
from fracctl.plants.hcw import Chief
from fracctl.plants.leader_orbit import LeaderOrbit, LeaderOrbits, leader_orbit
from fracctl.plants.relative_motion import checked_phase
from fracctl.plants.state import SecondOrder
from fracctl.units import EARTH_RADIUS_KM

EARTH_J2 = 1.08262668e-3
"""Second zonal harmonic of the Earth's gravity, from C₂₀ of EGM96."""


class PerturbedRelativeMotion(SecondOrder):
    """The position of a follower in the frame `rtn` of a leader, both under point-mass gravity, J2 and drag.

        ξ'' = Δa - 2 ω × ξ' - ω' × ξ - ω × (ω × ξ) + υ,        ω = [r a_n/h, 0, h/r²]

    with x radial outward, y along-track, z along the leader's momentary orbit normal, r and h of the leader's perturbed
    orbit, and the normal acceleration a_n it feels. Δa is what the follower feels more than the leader:

        a(R) = -R/R³ - 3k/(2R⁵) [(1 - 5s²) R + 2 (R·p) p] - d e^{(1 - R)/η} |v| v,        s = R·p/R,  k = J2 (R_E/a)²

    with the polar axis p and the inertial velocity v; the first term's difference is computed without cancellation, as
    in `RelativeMotion`. The atmosphere is a spherical exponential one at rest. Lengths over the leader's semi-major
    axis a, time over its Keplerian 1/n, both of the orbit that osculates at time 0. Without J2 and drag it is
    `RelativeMotion`.

    Args:
        leader: the orbit that osculates at time 0, and the argument of latitude then.
        eccentricity: e in [0, 1).
        true_anomaly_deg: of the leader at time 0, in degrees; 0 at perigee.
        j2: J2 of the planet; 0 for none.
        planet_radius_km: equatorial radius in km.
        density_kg_m3: of the atmosphere at the height of the semi-major axis, in kg/m³; 0 for none.
        scale_height_km: in which the density falls to 1/e, in km.
        leader_ballistic_m2_kg: C_D A/m of the leader in m²/kg.
        follower_ballistic_m2_kg: the same of the follower.

    Raises:
        ArgumentError: the orbit is not an ellipse, or a number is out of its range.
    """

    components = ("x", "y", "z")
    dispersed = (
        "follower_ballistic_m2_kg",
        "density_factor",
        "eccentricity",
        "true_anomaly_deg",
        "argument_of_latitude_deg",
    )
    """What `dispersed_by` takes."""

    def __init__(
        self,
        leader: Chief | None = None,
        eccentricity: float = 0.0,
        true_anomaly_deg: float = 0.0,
        j2: float = EARTH_J2,
        planet_radius_km: float = EARTH_RADIUS_KM,
        density_kg_m3: float = 0.0,
        scale_height_km: float = 50.0,
        leader_ballistic_m2_kg: float = 0.01,
        follower_ballistic_m2_kg: float = 0.01,
    ) -> None:
        self.eccentricity, self.true_anomaly_deg = checked_phase(eccentricity, true_anomaly_deg)
        if not math.isfinite(j2):
            raise ArgumentError("j2", j2, "must be a finite number")
        for name, value in (("planet_radius_km", planet_radius_km), ("scale_height_km", scale_height_km)):
            if not (math.isfinite(value) and value > 0.0):
                raise ArgumentError(name, value, "must be a positive number")
        ballistic = {
            "density_kg_m3": density_kg_m3,
            "leader_ballistic_m2_kg": leader_ballistic_m2_kg,
            "follower_ballistic_m2_kg": follower_ballistic_m2_kg,
        }
        for name, value in ballistic.items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ArgumentError(name, value, "must not be negative")
        self.leader = leader or Chief(semi_major_axis_km=6700.0)
        self.scales, a_km = self.leader.scales, self.leader.a_km
        oblateness, height = j2 * (planet_radius_km / a_km) ** 2, scale_height_km / a_km
        self._drag = 0.5 * density_kg_m3 * 1e3 * a_km
        drags = [self._drag * ballistic for ballistic in (leader_ballistic_m2_kg, follower_ballistic_m2_kg)]
        self._constants = np.array([[oblateness, *drags, height]])
        argument = self.leader.argument_of_latitude_deg
        self._orbit = self._leader_orbit(self.eccentricity, self.true_anomaly_deg, argument, drags[0])
        self._orbits = LeaderOrbits([self._orbit])

    def _leader_orbit(
        self, eccentricity: float, true_anomaly_deg: float, argument_of_latitude_deg: float, drag: float
    ) -> LeaderOrbit:
        oblateness, _, _, height = self._constants[0].tolist()
        angles = (self.leader.inclination_deg, argument_of_latitude_deg, true_anomaly_deg)
        inclination, argument, anomaly = (math.radians(angle) for angle in angles)
        return leader_orbit(eccentricity, inclination, argument, oblateness, drag, height, anomaly)

    @property
    def chief_elements(self) -> Elements:
        """Those of the leader's osculating orbit at time 0."""
        return self.leader.elements(self.eccentricity, self.true_anomaly_deg)

    @property
    def frame_rate(self) -> Floats:
        """Angular velocity [r a_n/h, 0, h/r²] of the frame at time 0, (3,)."""
        r, _, h, px, _, pz = self.leader_motion(np.zeros(1))[0]
        return np.array([-3.0 * self._constants[0, 0] / r**3 * px * pz / h, 0.0, h / r**2])

    @cached_property
    def period(self) -> float:  # type: ignore[override]
        """The nodal period: time between the leader's first two passages of the ascending node.

        Raises:
            UnsupportedError: the orbit is equatorial.
        """
        return self._orbit.nodal_period()

    def dispersed_by(self, **numbers: ArrayLike) -> PerturbedRelativeMotion:
        """Return the plant of b members, about leaders of their own where these differ; what is not given stays.

        Args:
            numbers: by the names of `dispersed`, (b,) each: C_D A/m of the followers in m²/kg; a factor on the density,
                for leader and follower; e, true anomaly and argument of latitude of the leaders at time 0.

        Raises:
            ArgumentError: a name is another, a number negative, or an orbit not an ellipse.
        """
        check_names(numbers, self.dispersed)
        given = {name: np.atleast_1d(finite(name, values)) for name, values in numbers.items()}
        for name in ("follower_ballistic_m2_kg", "density_factor"):
            if (given.get(name, np.zeros(1)) < 0.0).any():
                raise ArgumentError(name, float(given[name].min()), "must not be negative")
        b = np.broadcast_shapes(*(values.shape for values in given.values()))[0] if given else 1
        other = copy.copy(self)
        other._constants = np.repeat(self._constants[:1], b, axis=0)
        if "follower_ballistic_m2_kg" in given:
            other._constants[:, 2] = self._drag * given["follower_ballistic_m2_kg"]
        other._constants[:, 1:3] *= np.reshape(given.get("density_factor", 1.0), (-1, 1))
        if set(given) - {"follower_ballistic_m2_kg"}:
            nominal = (self.eccentricity, self.true_anomaly_deg, self.leader.argument_of_latitude_deg)
            names = ("eccentricity", "true_anomaly_deg", "argument_of_latitude_deg")
            columns = [np.broadcast_to(given.get(name, value), b) for name, value in zip(names, nominal, strict=True)]
            rows = zip(*(column.tolist() for column in columns), other._constants[:, 1].tolist(), strict=True)
            other._orbits = LeaderOrbits(
                [self._leader_orbit(*checked_phase(e, anomaly), argument, drag) for e, anomaly, argument, drag in rows]
            )
        return other

    @property
    def batch(self) -> int | None:
        """Batch size, None where all members share leader and drag."""
        return len(self._constants) if len(self._constants) > 1 else None

    def take(self, rows: Array) -> PerturbedRelativeMotion:
        """Return the plant of some members."""
        if self.batch is None:
            return self
        other = copy.copy(self)
        other._constants, other._orbits = self._constants[rows], self._orbits.take(rows)
        return other

    def leader_motion(self, t: Floats) -> Floats:
        """Return r, r', h and the polar axis in the leader's frame at times (b,) from 0 on, (b, 6)."""
        return self._orbits(t)

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return x' of x = [x, y, z, x', y', z'], (b, 6)."""
        constants = of_rows(self._constants, len(x))
        return _rates(self._orbits(t), x, u, constants)

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, 6, 6), and ∂f/∂u, (b, 6, 3), by differences of fourth order."""
        return FunctionPlant(self.rates, 6, 3).jacobians(t, x, u)


@compiled_with(error_model="numpy")
def _rates(leader: Floats, x: Floats, u: Floats, constants: Floats) -> Floats:
    out = np.empty_like(x)
    for i in range(len(x)):
        k, drag_leader, drag, height = constants[i]
        r, climb, h, px, py, pz = leader[i]
        bx, by, bz, vx, vy, vz = x[i]
        oblate = 3.0 * k / r**4
        thin = drag_leader * math.exp((1.0 - r) / height) * math.sqrt(climb * climb + h * h / (r * r))
        ax, ay = -0.5 * oblate * (1.0 - 3.0 * px * px) - thin * climb, -oblate * px * py - thin * h / r
        az = -oblate * px * pz
        w1, w3 = r * az / h, h / (r * r)
        h_rate = r * ay
        px_rate, pz_rate = w3 * py, -w1 * py
        w1_rate = -3.0 * k * (px_rate * pz + px * pz_rate) / (r**3 * h) - w1 * (3.0 * climb / r + h_rate / h)
        w3_rate = h_rate / (r * r) - 2.0 * h * climb / r**3

        q = (2.0 * r * bx + bx * bx + by * by + bz * bz) / (r * r)
        root = (1.0 + q) * math.sqrt(1.0 + q)
        f = q * (3.0 + q * (3.0 + q)) / (1.0 + root)
        pull = 1.0 / (r * r * r * root)
        far = r * math.sqrt(1.0 + q)
        up = (r + bx) * px + by * py + bz * pz
        flat = 1.5 * k / far**5
        central = flat * (1.0 - 5.0 * up * up / (far * far))
        sx, sy, sz = climb + vx - w3 * by, h / r + vy + w3 * bx - w1 * bz, vz + w1 * by
        thin = drag * math.exp((1.0 - far) / height) * math.sqrt(sx * sx + sy * sy + sz * sz)
        gx = -pull * (bx - r * f) - central * (r + bx) - 2.0 * flat * up * px - thin * sx - ax
        gy = -pull * by - central * by - 2.0 * flat * up * py - thin * sy - ay
        gz = -pull * bz - central * bz - 2.0 * flat * up * pz - thin * sz - az

        cx, cy, cz = -w3 * by, w3 * bx - w1 * bz, w1 * by
        out[i, 0], out[i, 1], out[i, 2] = vx, vy, vz
        out[i, 3] = gx + 2.0 * w3 * vy + w3_rate * by + w3 * cy + u[i, 0]
        out[i, 4] = gy - 2.0 * (w3 * vx - w1 * vz) - (w3_rate * bx - w1_rate * bz) - (w3 * cx - w1 * cz) + u[i, 1]
        out[i, 5] = gz - 2.0 * w1 * vy - w1_rate * by - w1 * cy + u[i, 2]
    return out
