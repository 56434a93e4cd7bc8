"""Measures of performance, each a function of a batch of trajectories, or of loops."""

from fracctl.measures.base import LoopMeasure, Measure, MeshMeasure, StepwiseMeasure
from fracctl.measures.boundedness import Boundedness, largest_distance
from fracctl.measures.control_effort import ControlEffort, control_effort
from fracctl.measures.delta_v import delta_v
from fracctl.measures.delta_v_per_orbit import DeltaVPerOrbit, delta_v_per_orbit
from fracctl.measures.drift_per_orbit import DriftPerOrbit, drift_per_orbit
from fracctl.measures.length_overshoot import LengthOvershoot, length_overshoot
from fracctl.measures.length_settling import LengthSettling, length_settling
from fracctl.measures.overshoot import Overshoot, overshoot
from fracctl.measures.peak_acceleration import PeakAcceleration, peak_acceleration
from fracctl.measures.periodicity_error import PeriodicityError, periodicity_error
from fracctl.measures.settling_periods import SettlingPeriods, settling_periods
from fracctl.measures.settling_time import SettlingTime, settling_time
from fracctl.measures.stability_margins import NoiseGain, Sensitivity, StabilityMargins

__all__ = [
    "Boundedness",
    "ControlEffort",
    "DeltaVPerOrbit",
    "DriftPerOrbit",
    "LengthOvershoot",
    "LengthSettling",
    "LoopMeasure",
    "Measure",
    "MeshMeasure",
    "NoiseGain",
    "Overshoot",
    "PeakAcceleration",
    "PeriodicityError",
    "Sensitivity",
    "SettlingPeriods",
    "SettlingTime",
    "StabilityMargins",
    "StepwiseMeasure",
    "control_effort",
    "delta_v",
    "delta_v_per_orbit",
    "drift_per_orbit",
    "largest_distance",
    "length_overshoot",
    "length_settling",
    "overshoot",
    "peak_acceleration",
    "periodicity_error",
    "settling_periods",
    "settling_time",
]
