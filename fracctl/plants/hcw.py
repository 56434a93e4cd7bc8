"""Hill-Clohessy-Wiltshire motion about a chief on a circular orbit, in the frame `rtn`.

    u'' = 2v' + 3u + υ_u,    v'' = -2u' + υ_v,    w'' = -w + υ_w        (Yaylali, Butcher, Sinclair, Eqs. 4-5)

u is radial outward, v along-track, w along the orbit normal; lengths over the chief's radius r, time s = n t,
accelerations over r n².
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fracctl.errors import ArgumentError
from fracctl.plants.linear import LinearPlant
from fracctl.units import EARTH_GRAVITATIONAL_PARAMETER_KM3_S2, Scales


@dataclass(frozen=True)
class Chief:
    """The chief's circular orbit; its radius and mean motion n = √(GM/a³) set the scales."""

    semi_major_axis_km: float = 1.0e4
    """a = r in km."""
    inclination_deg: float = 20.0
    """i in degrees; the linear motion does not depend on it."""
    gravitational_parameter_km3_s2: float = EARTH_GRAVITATIONAL_PARAMETER_KM3_S2
    """GM of the central body in km³/s²."""

    def __post_init__(self) -> None:
        for name in ("semi_major_axis_km", "gravitational_parameter_km3_s2"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ArgumentError(name, value, "must be a positive number")

    @property
    def mean_motion_rad_s(self) -> float:
        """n in rad/s."""
        return math.sqrt(self.gravitational_parameter_km3_s2 / self.semi_major_axis_km**3)

    @property
    def scales(self) -> Scales:
        """Length r and time 1/n."""
        return Scales(length_m=1e3 * self.semi_major_axis_km, time_s=1.0 / self.mean_motion_rad_s)


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


class HCW(_HCWPart):
    """All three components u, v, w; state [u v w u' v' w'] (Eq. 5)."""

    names = ("u", "v", "w")


class HCWInPlane(_HCWPart):
    """The coupled components u, v; state [u v u' v'] (Eq. 16)."""

    names = ("u", "v")


class HCWOutOfPlane(_HCWPart):
    """The component w alone, w'' = -w + υ_w; state [w w'] (Eq. 19)."""

    names = ("w",)
