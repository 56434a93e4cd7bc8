"""Drift: how far a motion moves on from one orbit to the next."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.measures.base import OfTrajectories
from fracctl.measures.periods import checked_period, differences, n_positions, periods, plant_period
from fracctl.stepwise import StepwiseTrajectory


class DriftPerOrbit(OfTrajectories):
    """|ξ(kT) - ξ((k-1)T)| for the last whole number k of periods, the change of position at equal phase.

    The positions are the first half of the state (the whole state of plants that are no `SecondOrder`). For motion
    relative to a leader T is the leader's period. A member that ended before the horizon is judged by its last two
    whole periods; +inf where it has not seen one.

    Args:
        unit: ``km``, or ``dimensionless``.
        period: T, () or (b,); None for the plant's, or else for the delay of the control.

    Raises:
        ArgumentError: the unit is another word, or the period is not positive.
    """

    name = "drift_per_orbit"

    def __init__(self, unit: Literal["km", "dimensionless"] = "km", period: ArrayLike | None = None) -> None:
        if unit not in ("km", "dimensionless"):
            raise ArgumentError("unit", repr(unit), "must be 'km' or 'dimensionless'")
        self.unit, self.period = unit, checked_period(period)
        self.columns = ("drift_per_orbit_km" if unit == "km" else "drift_per_orbit",)

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return column ``drift_per_orbit_km``, or ``drift_per_orbit``, (b,).

        Raises:
            UnsupportedError: the plant has no kilometres, or there is no period.
        """
        scales = trajectory.plant.scales
        if self.unit == "km" and scales is None:
            raise UnsupportedError("drift_per_orbit: this plant has no units; take unit 'dimensionless'")
        given = plant_period(trajectory) if self.period is None else self.period
        period = periods(trajectory, given)
        count = np.floor(trajectory.end / period * (1.0 + 1e-12))
        last = np.minimum(np.maximum(count, 1.0) * period, trajectory.horizon)[:, None]
        drift = differences(trajectory, last, period, n_positions(trajectory))[:, 0]
        factor = 1.0 if scales is None or self.unit != "km" else scales.length_m / 1e3
        return {self.columns[0]: np.where(count >= 1.0, factor * drift, np.inf)}


def drift_per_orbit(
    trajectory: StepwiseTrajectory, unit: Literal["km", "dimensionless"] = "km", period: ArrayLike | None = None
) -> Floats | float:
    """Return the drift of each trajectory, (b,), or a number for a single one; see `DriftPerOrbit`."""
    (value,) = DriftPerOrbit(unit, period)(trajectory).values()
    return value if trajectory.batched else float(value[0])
