"""Scales that lead from dimensionless quantities to SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fracctl.errors import ArgumentError

EARTH_GRAVITATIONAL_PARAMETER_KM3_S2 = 398600.4418
"""Geocentric gravitational constant GM, IERS Conventions (2010), Table 1.1."""
EARTH_RADIUS_KM = 6378.137
"""Equatorial radius of the Earth, WGS 84."""
STANDARD_GRAVITY_M_S2 = 9.80665
"""In which specific impulses are weighed, 3rd General Conference on Weights and Measures (1901)."""


@dataclass(frozen=True)
class Scales:
    """Length and time that correspond to 1 in dimensionless equations.

    ``position[m] = length_m * position``, ``time[s] = time_s * time``.

    Raises:
        ArgumentError: a unit is not a positive number.
    """

    length_m: float
    """Length unit in metres."""
    time_s: float
    """Time unit in seconds."""

    def __post_init__(self) -> None:
        for name in ("length_m", "time_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ArgumentError(name, value, "must be a positive number")

    @property
    def speed_m_s(self) -> float:
        """Speed unit in m/s."""
        return self.length_m / self.time_s

    @property
    def acceleration_m_s2(self) -> float:
        """Acceleration unit in m/s²."""
        return self.length_m / self.time_s**2

    @property
    def period_s(self) -> float:
        """Seconds in 2π units of dimensionless time, one orbit of the chief."""
        return 2.0 * math.pi * self.time_s


@dataclass(frozen=True)
class Spacecraft:
    """What flies, where masses and forces matter.

    Raises:
        ArgumentError: a number is not positive.
    """

    mass_kg: float | None = None
    """At time 0; what is burnt is not taken off."""
    thrust_n: float | None = None
    """Largest thrust."""
    isp_s: float | None = None
    """Specific impulse."""

    def __post_init__(self) -> None:
        for name in ("mass_kg", "thrust_n", "isp_s"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ArgumentError(name, value, "must be a positive number")
