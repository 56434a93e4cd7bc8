"""How much more a law spends than any control must."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats, positive
from fracctl.design.open_loop import least_effort
from fracctl.errors import ArgumentError
from fracctl.measures.control_effort import ControlEffort
from fracctl.measures.in_units import InUnits
from fracctl.measures.peak_acceleration import PeakAcceleration
from fracctl.measures.settling_time import SettlingTime
from fracctl.plants.linear import LinearPlant
from fracctl.trajectory import Trajectory

_SEGMENTS = 400


class OpenLoopBound(InUnits):
    """The least ΔV to rest in the law's own settling time under its own peak, and how much more the law spends.

    ``open_loop_delta_v_m_s`` is the bound of the linear programme `least_effort`, for thrusters along the axes;
    ``above_open_loop_percent`` is what ΔV up to the horizon is above it. The bound's control ends at rest, the law in
    its band. +inf where the law does not settle, which does not make a row unsettled. One programme of some 0.1 s for
    each row: for single points rather than for surveys.

    Args:
        threshold_m: δ of the settling time, in metres.

    Raises:
        ArgumentError: the band is not positive.
    """

    name = "open_loop_bound"
    columns = ("open_loop_delta_v_m_s", "above_open_loop_percent")
    may_be_infinite = True

    def __init__(self, threshold_m: float = 100.0) -> None:
        self.threshold_m = positive("threshold_m", threshold_m)

    def check(self) -> None:
        """Raise ArgumentError unless the plant is linear with constant coefficients and has units."""
        super().check()
        if self.plant is not None and not isinstance(self.plant, LinearPlant):
            raise ArgumentError("plant", self.plant, "must be linear with constant coefficients for this measure")

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the columns, (b,) each."""
        scales, plant = self.scales, self.plant
        assert isinstance(plant, LinearPlant)
        times = SettlingTime(self.threshold_m / scales.length_m)(trajectory)["settling_time"]
        peaks = PeakAcceleration()(trajectory)[PeakAcceleration.name]
        efforts = ControlEffort()(trajectory)[ControlEffort.name]
        bounds = np.full(len(times), np.inf)
        for i in np.flatnonzero(np.isfinite(times) & (times > 0.0)):
            state = trajectory.initial_state[i, : plant.n_states]
            found = least_effort(plant, state, float(times[i]), float(peaks[i]), _SEGMENTS)
            if found is not None:
                bounds[i] = found.lower_bound
        known = np.isfinite(bounds)
        above = np.full(len(times), np.inf)
        above[known] = 100.0 * (efforts[known] / bounds[known] - 1.0)
        return {self.columns[0]: scales.speed_m_s * bounds, self.columns[1]: above}
