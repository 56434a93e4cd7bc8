"""ΔV of an orbit under delayed feedback."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.measures.base import OfTrajectories
from fracctl.measures.delta_v import delta_v
from fracctl.measures.periods import checked_period, periods
from fracctl.stepwise import StepwiseTrajectory


class DeltaVPerOrbit(OfTrajectories):
    """(1/n) ∫ |u| dt over the first n controlled orbits, from switch-on t₀ to t₀ + n τ; the free orbit does not count.

    Where a run is shorter, or ended before, the mean is over what it flew under control; 0 where it flew free. The
    accuracy is that of `delta_v`.

    Args:
        orbits: n.
        unit: ``m_per_s``, or ``dimensionless`` for the plant's own.
        period: τ, () or (b,); None for the delay of the control (of the plant for a free motion).

    Raises:
        ArgumentError: a number is not positive, or the unit is another word.
    """

    name = "delta_v_per_orbit"

    def __init__(
        self,
        orbits: int = 20,
        unit: Literal["m_per_s", "dimensionless"] = "m_per_s",
        period: ArrayLike | None = None,
    ) -> None:
        if orbits < 1 or orbits != int(orbits):
            raise ArgumentError("orbits", orbits, "must be a whole number above 0")
        if unit not in ("m_per_s", "dimensionless"):
            raise ArgumentError("unit", repr(unit), "must be 'm_per_s' or 'dimensionless'")
        self.orbits, self.unit, self.period = int(orbits), unit, checked_period(period)
        self.columns = ("delta_v_per_orbit_m_per_s" if unit == "m_per_s" else "delta_v_per_orbit",)

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return column ``delta_v_per_orbit_m_per_s``, or ``delta_v_per_orbit``, (b,).

        Raises:
            UnsupportedError: the plant has no metres, or there is no period.
        """
        scales = trajectory.plant.scales
        if self.unit == "m_per_s" and scales is None:
            raise UnsupportedError("delta_v_per_orbit: this plant has no units; take unit 'dimensionless'")
        period = periods(trajectory, self.period)
        switch_on = np.min([term.switch_on for term in trajectory.terms], axis=0, initial=np.inf)
        start = np.minimum(switch_on, trajectory.end)
        stop = np.minimum(start + self.orbits * period, trajectory.end)
        flown = (stop - start) / period
        spent = np.atleast_1d(delta_v(trajectory, start, stop)) / np.where(flown > 0.0, flown, 1.0)
        factor = 1.0 if scales is None or self.unit != "m_per_s" else scales.speed_m_s
        return {self.columns[0]: factor * spent}


def delta_v_per_orbit(
    trajectory: StepwiseTrajectory,
    orbits: int = 20,
    unit: Literal["m_per_s", "dimensionless"] = "m_per_s",
    period: ArrayLike | None = None,
) -> Floats | float:
    """Return the ΔV of an orbit of each trajectory, (b,), or a number for a single one; see `DeltaVPerOrbit`."""
    (value,) = DeltaVPerOrbit(orbits, unit, period)(trajectory).values()
    return value if trajectory.batched else float(value[0])
