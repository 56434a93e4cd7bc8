"""Measures of performance, each a function of a batch of trajectories, or of loops.

Those of a single room, in units or of tethers, are loaded at first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use
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

if TYPE_CHECKING:
    from fracctl.measures.actuation_effort import ActuationEffort
    from fracctl.measures.angle_settling import AngleSettling
    from fracctl.measures.chattering import Chattering
    from fracctl.measures.final_delay import FinalDelay
    from fracctl.measures.final_distance import FinalDistance
    from fracctl.measures.final_gains import FinalGains
    from fracctl.measures.first_reversal import FirstReversal
    from fracctl.measures.floquet_multiplier import FloquetMultiplier
    from fracctl.measures.fuel import DeltaV, PeakForce, PeakThrust, Propellant, StationKeeping
    from fracctl.measures.hold_error import HoldError
    from fracctl.measures.implicit_steps import ImplicitSteps
    from fracctl.measures.largest_multiplier import LargestMultiplier
    from fracctl.measures.late_deviation import LateDeviation
    from fracctl.measures.lyapunov_exponent import LyapunovExponent
    from fracctl.measures.open_loop_bound import OpenLoopBound
    from fracctl.measures.overshoot_m import OvershootM
    from fracctl.measures.settling_times import SettlingTimes
    from fracctl.measures.tension import Tension
    from fracctl.measures.thruster_force import ThrusterForce

__all__ = [
    "ActuationEffort",
    "AngleSettling",
    "Boundedness",
    "Chattering",
    "ControlEffort",
    "DeltaV",
    "DeltaVPerOrbit",
    "DriftPerOrbit",
    "FinalDelay",
    "FinalDistance",
    "FinalGains",
    "FirstReversal",
    "FloquetMultiplier",
    "HoldError",
    "ImplicitSteps",
    "LargestMultiplier",
    "LateDeviation",
    "LengthOvershoot",
    "LengthSettling",
    "LoopMeasure",
    "LyapunovExponent",
    "Measure",
    "MeshMeasure",
    "NoiseGain",
    "OpenLoopBound",
    "Overshoot",
    "OvershootM",
    "PeakAcceleration",
    "PeakForce",
    "PeakThrust",
    "PeriodicityError",
    "Propellant",
    "Sensitivity",
    "SettlingPeriods",
    "SettlingTime",
    "SettlingTimes",
    "StabilityMargins",
    "StationKeeping",
    "StepwiseMeasure",
    "Tension",
    "ThrusterForce",
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

__getattr__ = loaded_at_first_use(
    __name__,
    {
        "ActuationEffort": "actuation_effort",
        "AngleSettling": "angle_settling",
        "Chattering": "chattering",
        "DeltaV": "fuel",
        "FinalDelay": "final_delay",
        "FinalDistance": "final_distance",
        "FinalGains": "final_gains",
        "FirstReversal": "first_reversal",
        "FloquetMultiplier": "floquet_multiplier",
        "HoldError": "hold_error",
        "ImplicitSteps": "implicit_steps",
        "LargestMultiplier": "largest_multiplier",
        "LateDeviation": "late_deviation",
        "LyapunovExponent": "lyapunov_exponent",
        "OpenLoopBound": "open_loop_bound",
        "OvershootM": "overshoot_m",
        "PeakForce": "fuel",
        "PeakThrust": "fuel",
        "Propellant": "fuel",
        "SettlingTimes": "settling_times",
        "StationKeeping": "fuel",
        "Tension": "tension",
        "ThrusterForce": "thruster_force",
    },
)
