"""Measures of performance, each a function of a batch of trajectories."""

from fracctl.measures.base import Measure
from fracctl.measures.control_effort import ControlEffort, control_effort
from fracctl.measures.delta_v import delta_v
from fracctl.measures.overshoot import Overshoot, overshoot
from fracctl.measures.peak_acceleration import PeakAcceleration, peak_acceleration
from fracctl.measures.settling_time import SettlingTime, settling_time

__all__ = [
    "ControlEffort",
    "Measure",
    "Overshoot",
    "PeakAcceleration",
    "SettlingTime",
    "control_effort",
    "delta_v",
    "overshoot",
    "peak_acceleration",
    "settling_time",
]
