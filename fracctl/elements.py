"""Orbit elements of a chief and of its neighbours, and the states that differences of them are in the frame `rtn`.

Lengths over the chief's semi-major axis, GM = 1. The elements [a, θ, i, q₁, q₂, Ω] hold for circular orbits too:
θ is the argument of latitude, q₁ = e cos ω, q₂ = e sin ω.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite
from fracctl.errors import ArgumentError


@dataclass(frozen=True)
class Elements:
    """One orbit and a place on it.

    Raises:
        ArgumentError: the orbit is not an ellipse, or a number is not finite.
    """

    semi_major_axis: float = 1.0
    """a > 0."""
    argument_of_latitude: float = 0.0
    """θ = ω + f, rad."""
    inclination: float = 0.0
    """i, rad."""
    q_1: float = 0.0
    """e cos ω."""
    q_2: float = 0.0
    """e sin ω."""
    raan: float = 0.0
    """Ω, right ascension of the ascending node, rad."""

    def __post_init__(self) -> None:
        finite("elements", self.array)
        if not self.semi_major_axis > 0.0:
            raise ArgumentError("semi_major_axis", self.semi_major_axis, "must be positive")
        if not math.hypot(self.q_1, self.q_2) < 1.0:
            raise ArgumentError("q_1, q_2", (self.q_1, self.q_2), "must be those of an ellipse, q₁² + q₂² < 1")

    @property
    def array(self) -> Floats:
        """[a, θ, i, q₁, q₂, Ω], (6,)."""
        angles = (self.argument_of_latitude, self.inclination, self.q_1, self.q_2, self.raan)
        return np.array([self.semi_major_axis, *angles], dtype=np.float64)

    def changed_by(self, differences: ArrayLike) -> Elements:
        """Return the orbit whose elements differ by [δa, δθ, δi, δq₁, δq₂, δΩ], (6,)."""
        return Elements(*(self.array + _six("differences", differences)).tolist())

    @property
    def in_plane(self) -> tuple[float, float, float, float]:
        """Radius r, its rate, the speed across it, and the angular momentum h."""
        c, s = math.cos(self.argument_of_latitude), math.sin(self.argument_of_latitude)
        parameter = self.semi_major_axis * (1.0 - self.q_1**2 - self.q_2**2)
        across = 1.0 + self.q_1 * c + self.q_2 * s
        unit = 1.0 / math.sqrt(parameter)
        return parameter / across, unit * (self.q_1 * s - self.q_2 * c), unit * across, math.sqrt(parameter)

    @property
    def axes(self) -> Floats:
        """Rows: the directions radial, along-track and along the orbit normal in the inertial frame, (3, 3)."""
        c, s = math.cos(self.argument_of_latitude), math.sin(self.argument_of_latitude)
        ci, si = math.cos(self.inclination), math.sin(self.inclination)
        cn, sn = math.cos(self.raan), math.sin(self.raan)
        radial = [cn * c - sn * s * ci, sn * c + cn * s * ci, s * si]
        along = [-cn * s - sn * c * ci, -sn * s + cn * c * ci, c * si]
        return np.array([radial, along, [sn * si, -cn * si, ci]])

    def inertial(self) -> tuple[Floats, Floats]:
        """Return position and velocity in the inertial frame, (3,) each."""
        r, climb, across, _ = self.in_plane
        axes = self.axes
        return r * axes[0], climb * axes[0] + across * axes[1]

    @classmethod
    def of_inertial(cls, position: ArrayLike, velocity: ArrayLike) -> Elements:
        """Return the elements of a state; Ω = 0 on an equatorial orbit, angles in (-π, π].

        Raises:
            ArgumentError: the orbit is not an ellipse.
        """
        place, speed = finite("position", position), finite("velocity", velocity)
        momentum = np.cross(place, speed)
        r, h = float(np.linalg.norm(place)), float(np.linalg.norm(momentum))
        normal = momentum / h
        inclination = math.atan2(math.hypot(normal[0], normal[1]), normal[2])
        raan = math.atan2(normal[0], -normal[1]) if math.hypot(normal[0], normal[1]) > 0.0 else 0.0
        node = np.array([math.cos(raan), math.sin(raan), 0.0])
        theta = math.atan2(float(np.cross(normal, node) @ place), float(node @ place))
        climb = float(place @ speed) / r
        size, turn = h * h / r - 1.0, h * climb
        c, s = math.cos(theta), math.sin(theta)
        energy = 2.0 / r - float(speed @ speed)
        if not energy > 0.0:
            raise ArgumentError("velocity", velocity, "must be that of an ellipse")
        return cls(1.0 / energy, theta, inclination, size * c + turn * s, size * s - turn * c, raan)


def chief_elements(
    eccentricity: float,
    true_anomaly_deg: float,
    inclination_deg: float,
    raan_deg: float,
    argument_of_latitude_deg: float,
) -> Elements:
    """Return the elements of a chief with a = 1 from the numbers of a configuration; ω = θ - f."""
    theta = math.radians(argument_of_latitude_deg)
    perigee = theta - math.radians(true_anomaly_deg)
    q = eccentricity * math.cos(perigee), eccentricity * math.sin(perigee)
    return Elements(1.0, theta, math.radians(inclination_deg), *q, math.radians(raan_deg))


def relative_state(chief: Elements, differences: ArrayLike, rate: ArrayLike | None = None) -> Floats:
    """Return [x, y, z, x', y', z'] of a neighbour in the chief's frame `rtn`, (6,): two inertial orbits, exactly.

    Args:
        chief: its elements.
        differences: [δa, δθ, δi, δq₁, δq₂, δΩ], (6,).
        rate: angular velocity of the frame in the frame; None for [0, 0, h/r²], that of an unperturbed chief.
    """
    place, speed = chief.inertial()
    neighbour, its_speed = chief.changed_by(differences).inertial()
    axes = chief.axes
    gap = axes @ (neighbour - place)
    turn = frame_rate(chief) if rate is None else finite("rate", rate)
    return np.concatenate([gap, axes @ (its_speed - speed) - np.cross(turn, gap)])


def element_differences(chief: Elements, state: ArrayLike, rate: ArrayLike | None = None) -> Floats:
    """Return [δa, δθ, δi, δq₁, δq₂, δΩ] of a neighbour, (6,): what `relative_state` takes; angles in (-π, π]."""
    relative = _six("state", state)
    place, speed = chief.inertial()
    turn = frame_rate(chief) if rate is None else finite("rate", rate)
    axes = chief.axes
    other = Elements.of_inertial(
        place + axes.T @ relative[:3], speed + axes.T @ (relative[3:] + np.cross(turn, relative[:3]))
    )
    difference: Floats = other.array - chief.array
    difference[[1, 5]] = (difference[[1, 5]] + math.pi) % math.tau - math.pi
    return difference


def frame_rate(chief: Elements) -> Floats:
    """Return the angular velocity [0, 0, h/r²] of the frame of an unperturbed chief, (3,)."""
    r, _, _, h = chief.in_plane
    return np.array([0.0, 0.0, h / r**2])


def linearised_map(chief: Elements) -> Floats:
    """Return Λ with [x, y, z, x', y', z'] ≈ Λ [δa, δθ, δi, δq₁, δq₂, δΩ], (6, 6).

    The derivative of `relative_state` at 0, for circular and elliptic chiefs.
    """
    a, theta, i, q_1, q_2, _ = chief.array.tolist()
    r, climb, across, h = chief.in_plane
    p, c, s, ci, si = h * h, math.cos(theta), math.sin(theta), math.cos(i), math.sin(i)
    out = np.zeros((6, 6))
    out[0, [0, 1, 3, 4]] = r / a, climb / across * r, -r / p * (2.0 * a * q_1 + r * c), -r / p * (2.0 * a * q_2 + r * s)
    out[1, [1, 5]] = r, r * ci
    out[2, [2, 5]] = r * s, -r * c * si
    out[3, [0, 1]] = -climb / (2.0 * a), (1.0 / r - 1.0 / p) * h
    out[3, [3, 4]] = (climb * a * q_1 + h * s) / p, (climb * a * q_2 - h * c) / p
    out[4, [0, 1, 5]] = -1.5 * across / a, -climb, climb * ci
    out[4, [3, 4]] = (3.0 * across * a * q_1 + 2.0 * h * c) / p, (3.0 * across * a * q_2 + 2.0 * h * s) / p
    out[5, [2, 5]] = across * c + climb * s, (across * s - climb * c) * si
    return out


def _six(name: str, value: ArrayLike) -> Floats:
    array = finite(name, value)
    if array.shape != (6,):
        raise ArgumentError(name, f"of shape {array.shape}", "must have shape (6,)")
    return array
