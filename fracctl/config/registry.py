"""What ``type: name`` in a configuration stands for: built in, or from an installed package through an entry point.

An extension declares, for instance::

    [project.entry-points."fracctl.plants"]
    my_plant = "my_package.plants:MyPlant"

and `type: my_plant` works wherever `hcw` does. The options are the arguments of the class, with their annotations and
defaults; an `ArgumentError` from the constructor is reported under the option's name. A survey is called with the
keywords `evaluation` and `seed` besides its options; a figure is a function of a run's results and of what is selected.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from typing import Any

from fracctl.errors import ConfigurationError, suggestion

BUILT_IN: Mapping[str, Mapping[str, str]] = {
    "plants": {
        "hcw": "fracctl.plants:HCW",
        "hcw_in_plane": "fracctl.plants:HCWInPlane",
        "hcw_out_of_plane": "fracctl.plants:HCWOutOfPlane",
        "linear": "fracctl.plants:LinearPlant",
        "libration": "fracctl.plants:Libration",
        "tschauner_hempel": "fracctl.plants:TschaunerHempel",
        "relative_motion": "fracctl.plants:RelativeMotion",
        "perturbed_relative_motion": "fracctl.plants:PerturbedRelativeMotion",
        "rotating_ellipsoid": "fracctl.plants:RotatingEllipsoid",
        "tether": "fracctl.plants:Tether",
    },
    "controllers": {
        "pd": "fracctl.controllers:PD",
        "pd_alpha": "fracctl.controllers:PDAlpha",
        "pd_lag": "fracctl.controllers:PDLag",
        "pid": "fracctl.controllers:PID",
        "pdd_alpha": "fracctl.controllers:PDDAlpha",
        "pi_lambda_d_mu": "fracctl.controllers:PILambdaDMu",
        "lqr": "fracctl.design:LQR",
        "delayed_feedback": "fracctl.controllers:DelayedFeedback",
        "adaptive_delay": "fracctl.controllers:AdaptiveDelayedFeedback",
        "delayed_lqr": "fracctl.design:DelayedLQR",
        "windowed_regulator": "fracctl.design:WindowedRegulator",
        "adaptive_sliding_mode": "fracctl.controllers:AdaptiveSlidingMode",
        "fractional_sliding_mode_reconstruction": "fracctl.controllers:FractionalSlidingMode",
    },
    "solvers": {
        "contour": "fracctl.solvers:Contour",
        "volterra": "fracctl.solvers:Volterra",
        "collocation": "fracctl.solvers:Collocation",
        "explicit_memory": "fracctl.solvers:ExplicitMemory",
        "method_of_steps": "fracctl.solvers:MethodOfSteps",
        "implicit_memory": "fracctl.solvers:ImplicitMemory",
    },
    "measures": {
        "settling_time": "fracctl.measures:SettlingTime",
        "overshoot": "fracctl.measures:Overshoot",
        "control_effort": "fracctl.measures:ControlEffort",
        "peak_acceleration": "fracctl.measures:PeakAcceleration",
        "settling_times": "fracctl.measures.settling_times:SettlingTimes",
        "delta_v": "fracctl.measures.fuel:DeltaV",
        "station_keeping": "fracctl.measures.fuel:StationKeeping",
        "peak_thrust": "fracctl.measures.fuel:PeakThrust",
        "peak_force": "fracctl.measures.fuel:PeakForce",
        "propellant": "fracctl.measures.fuel:Propellant",
        "hold_error": "fracctl.measures.hold_error:HoldError",
        "overshoot_m": "fracctl.measures.overshoot_m:OvershootM",
        "open_loop_bound": "fracctl.measures.open_loop_bound:OpenLoopBound",
        "periodicity_error": "fracctl.measures:PeriodicityError",
        "settling_periods": "fracctl.measures:SettlingPeriods",
        "delta_v_per_orbit": "fracctl.measures:DeltaVPerOrbit",
        "drift_per_orbit": "fracctl.measures:DriftPerOrbit",
        "boundedness": "fracctl.measures:Boundedness",
        "stability_margins": "fracctl.measures:StabilityMargins",
        "sensitivity": "fracctl.measures:Sensitivity",
        "noise_gain": "fracctl.measures:NoiseGain",
        "floquet_multiplier": "fracctl.measures.floquet_multiplier:FloquetMultiplier",
        "final_delay": "fracctl.measures.final_delay:FinalDelay",
        "lyapunov_exponent": "fracctl.measures.lyapunov_exponent:LyapunovExponent",
        "largest_multiplier": "fracctl.measures.largest_multiplier:LargestMultiplier",
        "length_settling": "fracctl.measures.length_settling:LengthSettling",
        "late_deviation": "fracctl.measures.late_deviation:LateDeviation",
        "length_overshoot": "fracctl.measures.length_overshoot:LengthOvershoot",
        "first_reversal": "fracctl.measures.first_reversal:FirstReversal",
        "angle_settling": "fracctl.measures.angle_settling:AngleSettling",
        "tension": "fracctl.measures.tension:Tension",
        "actuation_effort": "fracctl.measures.actuation_effort:ActuationEffort",
        "chattering": "fracctl.measures.chattering:Chattering",
        "thruster_force": "fracctl.measures.thruster_force:ThrusterForce",
        "final_gains": "fracctl.measures.final_gains:FinalGains",
        "implicit_steps": "fracctl.measures.implicit_steps:ImplicitSteps",
    },
    "surveys": {
        "single": "fracctl.surveys:Single",
        "grid": "fracctl.surveys:Grid",
        "lqr_seed": "fracctl.surveys:LQRSeed",
        "pattern_search": "fracctl.surveys:PatternSearchSurvey",
        "continuation": "fracctl.surveys:Continuation",
        "search": "fracctl.surveys:PopulationSearch",
        "comparison": "fracctl.comparison:Comparison",
    },
    "figures": {
        "gain_contours": "fracctl.figures.gain_contours:build",
        "trajectories": "fracctl.figures.trajectories:build",
        "objective_against_order": "fracctl.figures.objective_against_order:build",
        "order_contours": "fracctl.figures.order_contours:build",
        "pareto_fronts": "fracctl.figures.pareto_fronts:build",
        "poles": "fracctl.figures.poles:build",
        "bode": "fracctl.figures.bode:build",
        "nyquist": "fracctl.figures.nyquist:build",
        "work_precision": "fracctl.figures.work_precision:build",
        "settling_against_band": "fracctl.figures.settling_against_band:build",
        "settling_against_effort": "fracctl.figures.settling_against_effort:build",
        "orbits": "fracctl.figures.orbits:build",
        "feedback": "fracctl.figures.feedback:build",
        "drift": "fracctl.figures.drift:build",
        "multiplier_window": "fracctl.figures.multiplier_window:build",
        "deployment": "fracctl.figures.deployment:build",
        "settling_against_overshoot": "fracctl.figures.settling_against_overshoot:build",
        "spread": "fracctl.figures.spread:build",
        "survival": "fracctl.figures.survival:build",
        "approach": "fracctl.figures.approach:build",
        "position_error": "fracctl.figures.position_error:build",
        "acceleration": "fracctl.figures.acceleration:build",
    },
    "conf": {},
}
"""Kind, then name, to ``module:attribute``."""


def names(kind: str) -> tuple[str, ...]:
    """All names of a kind, e.g. of `plants`: the built-in ones, then those of extensions."""
    return (*BUILT_IN[kind], *sorted(set(entry_points(kind)) - set(BUILT_IN[kind])))


def load(kind: str, name: str) -> Any:
    """Import what a name stands for.

    Raises:
        ConfigurationError: there is no such name, two packages claim it, or an extension cannot be imported.
    """
    extensions = entry_points(kind)
    if name in BUILT_IN[kind]:
        if name in extensions:
            raise ConfigurationError(f"{_owner(extensions[name])} calls one of its {kind} '{name}', which is built in")
        module, _, attribute = BUILT_IN[kind][name].partition(":")
        return getattr(importlib.import_module(module), attribute)
    if name not in extensions:
        known = ", ".join(names(kind))
        raise ConfigurationError(f"must be one of {known}{suggestion(name, names(kind))}")
    return load_entry_point(kind, name)


def load_entry_point(kind: str, name: str) -> Any:
    """Import an extension's object; whatever the import raises becomes a ConfigurationError."""
    entry = entry_points(kind)[name]
    try:
        return entry.load()
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise ConfigurationError(f"{_owner(entry)}: '{entry.value}' cannot be imported ({reason})") from error


@cache
def entry_points(kind: str) -> Mapping[str, metadata.EntryPoint]:
    """Extensions of a kind by name."""
    found: dict[str, metadata.EntryPoint] = {}
    for entry in metadata.entry_points(group=f"fracctl.{kind}"):
        if entry.name in found and entry.value != found[entry.name].value:
            owners = f"{_owner(found[entry.name])} and {_owner(entry)}"
            raise ConfigurationError(f"{owners} both call one of their {kind} '{entry.name}'")
        found[entry.name] = entry
    return found


def _owner(entry: metadata.EntryPoint) -> str:
    return f"package '{entry.dist.name}'" if entry.dist else "an installed package"
