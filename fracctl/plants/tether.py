"""A subsatellite on a massless straight tether below a heavy satellite on an elliptic orbit."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, batch_size, finite, positive
from fracctl.compiling import ACCELERATION, compiled_with, pointer_with
from fracctl.errors import ArgumentError
from fracctl.plants.capabilities import of_rows
from fracctl.plants.state import Event, SecondOrder
from fracctl.units import EARTH_GRAVITATIONAL_PARAMETER_KM3_S2, EARTH_RADIUS_KM


@pointer_with(ACCELERATION)
def _acceleration(f: float, q: Floats, v: Floats, u: Floats, parameters: Floats, out: Floats) -> None:
    """Write ξ'' to `out`, (3,), for the parameters [e, ρ, d_λ, d_θ, d_φ, phase]."""
    length, cos, sin = q[0], math.cos(q[2]), math.sin(q[2])
    k = 1.0 + parameters[0] * math.cos(f)
    b = 2.0 * parameters[0] * math.sin(f) / k
    wave = math.sin(f + parameters[5])
    square, turn, growth = length * length, v[1] + 1.0, v[0] / length
    gravity, radial = 3.0 / k * math.cos(q[1]), 1.0 / k
    out[0] = u[0] - parameters[1] + parameters[2] * wave + b * v[0]
    out[0] += length * (v[2] * v[2] + (turn * turn + gravity * math.cos(q[1])) * cos * cos - radial)
    out[1] = (u[1] + parameters[3] * wave) / (square * cos * cos) - gravity * math.sin(q[1])
    out[1] += turn * (b - 2.0 * growth + 2.0 * v[2] * sin / cos)
    out[2] = (u[2] + parameters[4] * wave) / square + (b - 2.0 * growth) * v[2]
    out[2] -= (turn * turn + gravity * math.cos(q[1])) * sin * cos


class Tether(SecondOrder):
    """A dumbbell of length λ with in-plane angle θ and out-of-plane angle φ, as functions of the true anomaly f.

        λ'' = τ_t - ρ + d_λ + bλ' + λ[φ'² + (θ'+1)² cos²φ] - (λ/k)(1 - 3 cos²θ cos²φ)
        θ'' = (τ_θ + d_θ)/(λ² cos²φ) + b(θ'+1) - 2(λ'/λ)(θ'+1) + 2 tanφ φ'(θ'+1) - (3/k) sinθ cosθ
        φ'' = (τ_φ + d_φ)/λ² + bφ' - 2(λ'/λ)φ' - [(θ'+1)² + (3/k) cos²θ] sinφ cosφ

    with k = 1 + e cos f and b = 2e sin f/k (Zhong, Shao, Li, Ma, Sun, Eqs. 1 to 5, where B₀ is -bH and the second row
    of G ends with -bλ² cos²φ). Angles are in radians and not wrapped. The controls are (τ_t, τ_θ, τ_φ); the tension
    ρ - τ_t is that in N over m̄ ḟ² L, the torques those in N m over m̄ ḟ² L², m̄ = m₁m₂/(m₁+m₂), and the disturbances
    d_i sin(f + phase) are over the same. λ is over the full length L.

    These units vary along the orbit and two of the three positions are angles, so that there are no `scales`: metres
    are `length_m` λ, and `tension_n`, `torques_n_m`, `thruster_force_n` and `orbits` give the rest. The event
    ``collision`` is the tether's length falling to `shortest`: the two satellites meet, past it the equations mean
    nothing; ``escaped`` is its growing to `longest`, more than there is; ``slack`` a tension below zero, which no loop
    within the bounds comes to.

    Args:
        eccentricity: e in [0, 1).
        perigee_altitude_km: above the Earth's equatorial radius, for units alone.
        length_m: L, for units alone.
        mother_mass_kg: m₁, for units alone.
        subsatellite_mass_kg: m₂, for units alone.
        tension: bounds of the tension ρ - τ_t; ρ is their mean. They and `torque` hold in every `ClosedLoop` that is
            not given a saturation of its own.
        torque: bound of |τ_θ| and |τ_φ|.
        disturbance: amplitudes d of the three rows, (3,) or (b, 3).
        disturbance_phase: in radians, () or (b,).
        shortest: λ at which two satellites meet.
        longest: λ up to which there is tether on the reel.

    Raises:
        ArgumentError: the orbit is not an ellipse, a number is not positive, the bounds of the tension are not two
            rising numbers from 0 on, a disturbance is not finite or has another shape, or their batch sizes differ.
    """

    components = ("length", "theta", "phi")
    angles = ("theta", "phi")
    scales = None
    period = 2.0 * math.pi
    acceleration = staticmethod(_acceleration)
    dispersed = ("disturbance_phase", "disturbance_factor")
    """What `dispersed_by` takes."""

    def __init__(
        self,
        eccentricity: float = 0.0027,
        perigee_altitude_km: float = 249.0,
        length_m: float = 3500.0,
        mother_mass_kg: float = 6530.0,
        subsatellite_mass_kg: float = 12.0,
        tension: Sequence[float] = (0.10, 5.00),
        torque: float = 5.0,
        disturbance: ArrayLike = (0.05, 0.05, 0.05),
        disturbance_phase: ArrayLike = 0.0,
        shortest: float = 1e-4,
        longest: float = 2.0,
    ) -> None:
        if not 0.0 <= eccentricity < 1.0:
            raise ArgumentError("eccentricity", eccentricity, "must lie in [0, 1)")
        given = {
            "perigee_altitude_km": perigee_altitude_km,
            "length_m": length_m,
            "mother_mass_kg": mother_mass_kg,
            "subsatellite_mass_kg": subsatellite_mass_kg,
            "torque": torque,
            "shortest": shortest,
            "longest": longest,
        }
        for name, value in given.items():
            positive(name, value)
        if not (len(tension) == 2 and 0.0 <= tension[0] < tension[1] < math.inf):
            raise ArgumentError("tension", tension, "must be two numbers, 0 <= least < largest")
        self.eccentricity, self.length_m, self.shortest = float(eccentricity), float(length_m), float(shortest)
        self.longest = float(longest)
        self.perigee_km = EARTH_RADIUS_KM + perigee_altitude_km
        self.reduced_mass_kg = mother_mass_kg * subsatellite_mass_kg / (mother_mass_kg + subsatellite_mass_kg)
        self.rho, half = 0.5 * (tension[0] + tension[1]), 0.5 * (tension[1] - tension[0])
        self.limits = np.array([[half, torque, torque]])
        self._parameters = _parameters(self.eccentricity, self.rho, disturbance, disturbance_phase)

    @property
    def events(self) -> tuple[Event, ...]:
        """The meeting of the two satellites, and the end of the tether."""
        meaning = f"the tether's length fell to {self.shortest:g}, where the satellites meet and the equations end"
        run_out = f"the tether ran out to {self.longest:g} of its length"
        return (
            Event("collision", lambda _, x: x[:, 0] - self.shortest, meaning=meaning),
            Event("escaped", lambda _, x: self.longest - x[:, 0], meaning=run_out),
        )

    @property
    def control_events(self) -> tuple[Event, ...]:
        """A tension below zero."""
        meaning = "the tension fell below zero, where a tether is slack and the equations end"
        return (Event("slack", lambda _, u: self.rho - u[:, 0], meaning=meaning),)

    @property
    def orbital_period_s(self) -> float:
        """Time from perigee to perigee."""
        axis = self.perigee_km / (1.0 - self.eccentricity)
        return 2.0 * math.pi * math.sqrt(axis**3 / EARTH_GRAVITATIONAL_PARAMETER_KM3_S2)

    def rate_rad_s(self, f: ArrayLike) -> Floats:
        """Return ḟ in rad/s at true anomalies f, shaped as these."""
        k = 1.0 + self.eccentricity * np.cos(f)
        mean = math.sqrt(EARTH_GRAVITATIONAL_PARAMETER_KM3_S2 / (self.perigee_km * (1.0 + self.eccentricity)) ** 3)
        rate: Floats = mean * k**2
        return rate

    def orbits(self, f: ArrayLike) -> Floats:
        """Return the time since the perigee at f = 0 in orbital periods, t/T, at true anomalies f, shaped as these."""
        e, angle = self.eccentricity, finite("f", f)
        root, turns = math.sqrt(1.0 - e**2), np.round(angle / (2.0 * np.pi))
        within = angle - 2.0 * np.pi * turns
        anomaly = 2.0 * np.arctan2(math.sqrt(1.0 - e) * np.sin(within / 2), math.sqrt(1.0 + e) * np.cos(within / 2))
        since = anomaly - e * root * np.sin(within) / (1.0 + e * np.cos(within))
        periods: Floats = turns + since / (2.0 * np.pi)
        return periods

    def tension_n(self, f: ArrayLike, u: Floats) -> Floats:
        """Return the tension in N at true anomalies f (…) and controls u (…, 3), (…)."""
        tension: Floats = self._force_n(f) * (self.rho - u[..., 0])
        return tension

    def torques_n_m(self, f: ArrayLike, u: Floats) -> Floats:
        """Return the in-plane and out-of-plane torques in N m at f (…) and controls u (…, 3), (…, 2)."""
        torques: Floats = (self._force_n(f) * self.length_m)[..., None] * u[..., 1:]
        return torques

    def thruster_force_n(self, f: ArrayLike, x: Floats, u: Floats) -> Floats:
        """Return the forces on the subsatellite that make these torques at states x (…, 6), in N, (…, 2).

        Across the tether: τ_θ/(λ cos φ) in the plane, for the arm of that torque is λ cos φ, and τ_φ/λ out of it.
        """
        arm = np.stack([x[..., 0] * np.cos(x[..., 2]), x[..., 0]], axis=-1)
        force: Floats = self._force_n(f)[..., None] * u[..., 1:] / arm
        return force

    def _force_n(self, f: ArrayLike) -> Floats:
        return self.reduced_mass_kg * self.rate_rad_s(f) ** 2 * self.length_m

    def dispersed_by(self, disturbance_phase: ArrayLike = 0.0, disturbance_factor: ArrayLike = 1.0) -> Tether:
        """Return the tether with disturbances d_i factor sin(f + phase) of b members, () or (b,) each, in rad and 1."""
        phase, factor = finite("disturbance_phase", disturbance_phase), finite("disturbance_factor", disturbance_factor)
        other = copy.copy(self)
        e, rho, *disturbance, own_phase = self._parameters.T
        amplitudes = np.stack(disturbance, axis=-1) * factor.reshape(-1, 1)
        other._parameters = _parameters(float(e[0]), float(rho[0]), amplitudes, own_phase + phase.ravel())
        return other

    @property
    def batch(self) -> int | None:
        """Batch size, None where all members share the disturbances."""
        return len(self._parameters) if len(self._parameters) > 1 else None

    def take(self, rows: Array) -> Tether:
        """Return the plant of some members."""
        if self.batch is None:
            return self
        other = copy.copy(self)
        other._parameters = self._parameters[rows]
        return other

    def kernel_parameters(self, batch: int) -> Floats:
        """Return the parameters of `acceleration` for each member of a batch, [e, ρ, d, phase], (b, 6).

        Raises:
            ArgumentError: the disturbances are those of another number of members.
        """
        return of_rows(self._parameters, batch)

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return x' of x = [λ, θ, φ, λ', θ', φ'], (b, 6)."""
        return _rates(t, x, u, self.kernel_parameters(len(x)))

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, 6, 6), and ∂f/∂u, (b, 6, 3)."""
        length, theta, phi, length_rate, theta_rate, phi_rate = x.T
        k = 1.0 + self.eccentricity * np.cos(t)
        b = 2.0 * self.eccentricity * np.sin(t) / k
        parameters = self.kernel_parameters(len(x))
        torque = u + parameters[:, 2:5] * np.sin(t + parameters[:, 5])[:, None]
        cos, sin, tan, turn, growth = np.cos(phi), np.sin(phi), np.tan(phi), theta_rate + 1.0, length_rate / length
        square, cos_2, across = length**2, np.cos(theta) ** 2, np.sin(2.0 * theta)
        state, control = np.zeros((len(x), 6, 6)), np.zeros((len(x), 6, u.shape[1]))
        state[:, :3, 3:] = np.eye(3)
        state[:, 3, 0] = phi_rate**2 + (turn * cos) ** 2 - (1.0 - 3.0 * cos_2 * cos**2) / k
        state[:, 3, 1] = -3.0 * length / k * across * cos**2
        state[:, 3, 2] = -2.0 * length * cos * sin * (turn**2 + 3.0 * cos_2 / k)
        state[:, 3, 3], state[:, 3, 4], state[:, 3, 5] = b, 2.0 * length * turn * cos**2, 2.0 * length * phi_rate
        push = torque[:, 1] / (square * cos**2)
        state[:, 4, 0] = 2.0 * (growth * turn - push) / length
        state[:, 4, 1] = -3.0 / k * np.cos(2.0 * theta)
        state[:, 4, 2] = 2.0 * (push * tan + turn * phi_rate / cos**2)
        state[:, 4, 3], state[:, 4, 5] = -2.0 * turn / length, 2.0 * tan * turn
        state[:, 4, 4] = b - 2.0 * growth + 2.0 * tan * phi_rate
        state[:, 5, 0] = 2.0 * (growth * phi_rate - torque[:, 2] / square) / length
        state[:, 5, 1] = 3.0 / k * across * sin * cos
        state[:, 5, 2] = -(turn**2 + 3.0 / k * cos_2) * np.cos(2.0 * phi)
        state[:, 5, 3], state[:, 5, 4] = -2.0 * phi_rate / length, -2.0 * turn * sin * cos
        state[:, 5, 5] = b - 2.0 * growth
        control[:, 3, 0], control[:, 4, 1], control[:, 5, 2] = 1.0, 1.0 / (square * cos**2), 1.0 / square
        return state, control


@compiled_with(error_model="numpy")
def _rates(t: Floats, x: Floats, u: Floats, parameters: Floats) -> Floats:
    out = np.empty_like(x)
    q, v, control, second = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(x)):
        for j in range(3):
            q[j], v[j], control[j] = x[i, j], x[i, 3 + j], u[i, j]
        _acceleration(t[i], q, v, control, parameters[i], second)
        for j in range(3):
            out[i, j], out[i, 3 + j] = v[j], second[j]
    return out


def _parameters(eccentricity: float, rho: float, disturbance: ArrayLike, phase: ArrayLike) -> Floats:
    """Return [e, ρ, d, phase] for the members that differ, (1, 6) or (b, 6)."""
    amplitudes, phases = finite("disturbance", disturbance), finite("disturbance_phase", phase)
    if amplitudes.ndim not in (1, 2) or amplitudes.shape[-1] != 3:
        raise ArgumentError("disturbance", f"of shape {amplitudes.shape}", "must have shape (3,) or (b, 3)")
    if phases.ndim > 1:
        raise ArgumentError("disturbance_phase", f"of shape {phases.shape}", "must have shape () or (b,)")
    members = batch_size(disturbance=(amplitudes, 1), disturbance_phase=(phases, 0)) or 1
    out = np.empty((members, 6))
    out[:, 0], out[:, 1], out[:, 2:5], out[:, 5] = eccentricity, rho, amplitudes, phases
    return out
