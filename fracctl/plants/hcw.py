"""Hill-Clohessy-Wiltshire motion about a chief on a circular orbit, in the frame `rtn`.

    u'' = 2v' + 3u + υ_u,    v'' = -2u' + υ_v,    w'' = -w + υ_w        (Yaylali, Butcher, Sinclair, Eqs. 4-5)

u is radial outward, v along-track, w along the orbit normal; lengths over the chief's radius r, time s = n t,
accelerations over r n².
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import positive
from fracctl.elements import Elements, chief_elements
from fracctl.errors import ArgumentError
from fracctl.plants.linear import LinearPlant
from fracctl.units import EARTH_GRAVITATIONAL_PARAMETER_KM3_S2, EARTH_RADIUS_KM, Scales

_DEFAULT_KM = 1.0e4
"""The chief of Yaylali, Butcher and Sinclair."""


@dataclass(frozen=True)
class Chief:
    """The chief's orbit and where it is on it; the semi-major axis a and the mean motion n = √(GM/a³) set the scales.

    Raises:
        ArgumentError: a number is not finite or not positive where it must be, or both of a and altitude are given.
    """

    semi_major_axis_km: float | None = None
    """a in km; 10⁴ km where no altitude is given either."""
    inclination_deg: float = 20.0
    """i in degrees; motion about a spherical planet does not depend on it, nor on Ω and θ."""
    gravitational_parameter_km3_s2: float = EARTH_GRAVITATIONAL_PARAMETER_KM3_S2
    """GM of the central body in km³/s²."""
    altitude_km: float | None = None
    """a less the Earth's equatorial radius, in km, instead of a."""
    raan_deg: float = 0.0
    """Ω, right ascension of the ascending node, in degrees."""
    argument_of_latitude_deg: float = 0.0
    """θ at time 0, from the ascending node, in degrees."""

    def __post_init__(self) -> None:
        if self.semi_major_axis_km is not None and self.altitude_km is not None:
            allowed = f"must not be given beside semi_major_axis_km = {self.semi_major_axis_km:g}"
            raise ArgumentError("altitude_km", self.altitude_km, allowed, "set one of the two to null")
        for name in ("semi_major_axis_km", "altitude_km", "gravitational_parameter_km3_s2"):
            value = getattr(self, name)
            if value is not None:
                positive(name, value)
        for name in ("inclination_deg", "raan_deg", "argument_of_latitude_deg"):
            if not math.isfinite(getattr(self, name)):
                raise ArgumentError(name, getattr(self, name), "must be a finite number")

    @property
    def a_km(self) -> float:
        """a in km."""
        if self.altitude_km is not None:
            return EARTH_RADIUS_KM + self.altitude_km
        return _DEFAULT_KM if self.semi_major_axis_km is None else self.semi_major_axis_km

    @property
    def mean_motion_rad_s(self) -> float:
        """n in rad/s."""
        return math.sqrt(self.gravitational_parameter_km3_s2 / self.a_km**3)

    @property
    def scales(self) -> Scales:
        """Length a and time 1/n."""
        return Scales(length_m=1e3 * self.a_km, time_s=1.0 / self.mean_motion_rad_s)

    def elements(self, eccentricity: float = 0.0, true_anomaly_deg: float = 0.0) -> Elements:
        """Return the elements at time 0, over a."""
        angles = (self.inclination_deg, self.raan_deg, self.argument_of_latitude_deg)
        return chief_elements(eccentricity, true_anomaly_deg, *angles)


_STIFFNESS = np.diag([3.0, 0.0, -1.0])
_DAMPING = np.array([[0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


class _HCWPart(LinearPlant):
    names: tuple[str, ...]
    period = 2.0 * math.pi

    def __init__(self, chief: Chief | None = None) -> None:
        self.chief = chief or Chief()
        rows = ["uvw".index(name) for name in self.names]
        block = np.ix_(rows, rows)
        super().__init__(_STIFFNESS[block], _DAMPING[block], self.names, self.chief.scales)

    @property
    def chief_elements(self) -> Elements:
        """Those of the chief at time 0."""
        return self.chief.elements()


class HCW(_HCWPart):
    """All three components u, v, w; state [u v w u' v' w'] (Eq. 5)."""

    names = ("u", "v", "w")


class HCWInPlane(_HCWPart):
    """The coupled components u, v; state [u v u' v'] (Eq. 16)."""

    names = ("u", "v")


class HCWOutOfPlane(_HCWPart):
    """The component w alone, w'' = -w + υ_w; state [w w'] (Eq. 19)."""

    names = ("w",)
