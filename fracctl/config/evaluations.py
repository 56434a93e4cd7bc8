"""Schemas of evaluations, and of the spacecraft that they fly."""

from __future__ import annotations

import inspect
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, SerializeAsAny

from fracctl.config.fields import Name, Number, Strict, Typed, Whole, refusal, refuse
from fracctl.config.options import construct, factory_of, typed_options_of
from fracctl.dispersions import Distribution
from fracctl.errors import ArgumentError
from fracctl.flight import STAGES

Positive = Annotated[Number, Field(gt=0.0)] | None
"""A positive number, or nothing."""
NotNegative = Annotated[Number, Field(ge=0.0)]


class PerformanceEvaluation(Typed):
    """Measures of trajectories, and objectives."""

    type: Literal["performance"] = "performance"
    largest_control: Positive = None
    """What the thrusters can give, dimensionless; None for any."""
    largest_acceleration_mm_s2: Positive = None
    """The same in mm/s²."""
    largest_by: Literal["norm", "axis"] = "norm"
    """Whether that limits the magnitude or each component."""


class AccuracyEvaluation(Typed):
    """Errors and costs of the solvers."""

    type: Literal["accuracy"]
    contour: list[Number] = Field(default_factory=list)
    """Tolerances."""
    volterra: list[Whole] = Field(default_factory=list)
    """Nodes on each panel."""
    collocation: list[Whole] = Field(default_factory=list)
    """Degrees of the polynomial."""
    members: Annotated[Whole, Field(ge=1)] = 256
    """Largest size of the batch that is timed."""
    repeats: Annotated[Whole, Field(ge=1)] = 3
    """How often it is timed."""


class DelayedEvaluation(Typed):
    """Runs under delayed feedback."""

    type: Literal["delayed"]
    delay_from: Literal["given", "period", "first_return"] = "given"
    """Where τ comes from: `controller.delay`, the plant's own period, or the first return of the free motion."""
    largest_control: Positive = None
    """What the thrusters can give, dimensionless; None for any."""
    largest_acceleration_mm_s2: Positive = None
    """The same in mm/s²."""
    largest_by: Literal["norm", "axis"] = "norm"
    """Whether that limits the magnitude or each component."""


class NamedLaw(Typed):
    """A law among several."""

    values: dict[str, Number] = Field(default_factory=dict)
    """Values of its parameters; their defaults where none are given."""


def _named_law(value: NamedLaw) -> NamedLaw:
    factory_of("controllers", value.model_dump())
    return value


def _dispersions(value: dict[str, list[Any] | None]) -> dict[str, list[Any] | None]:
    """Check distributions; what is null is certain, so that an experiment can take away what another one has."""
    given = {name: entry for name, entry in value.items() if entry is not None}
    lines = []
    for name, entry in given.items():
        try:
            Distribution.of(entry)
        except ArgumentError as error:
            lines.append(refusal((name,), entry, error.allowed))
    if lines:
        raise refuse(*lines)
    return dict(given)


Dispersions = Annotated[dict[str, list[Any] | None], AfterValidator(_dispersions)]
"""Distributions by name: ``[normal, mean, deviation]``, ``[uniform, lowest, highest]``, ``[choice, …]``, or null."""


class MemoryEvaluation(Typed):
    """Runs of laws with a memory in the loop."""

    type: Literal["memory"]
    laws: dict[str, Annotated[NamedLaw, AfterValidator(_named_law)]] = Field(default_factory=dict)
    """Laws that are run one after the other, by the names they have in tables; none for `controller`."""
    dispersions: Dispersions = Field(default_factory=dict)
    """Distributions by what is uncertain: ``[normal, mean, deviation]``, ``[uniform, from, to]``, ``[choice, …]``."""
    samples: Annotated[Whole, Field(ge=1)] = 200
    """How many are drawn where there are distributions."""
    first_sample: Annotated[Whole, Field(ge=0)] = 0
    """Number of the first."""


class RobustEvaluation(Typed):
    """Design points judged over dispersed starts."""

    type: Literal["robust"]
    dispersions: Dispersions = Field(default_factory=dict)
    """Distributions by what is added to a start: ``offset_w_m``, ``offset_w_dot_m_s``, ``offset_w_percent``, …"""
    samples: Annotated[Whole, Field(ge=1)] = 50
    """Starts about each initial condition."""
    first_sample: Annotated[Whole, Field(ge=0)] = 0
    """Number of the first."""
    quantile: Annotated[Number, Field(gt=0.0, le=1.0)] = 0.95
    """Share of the starts that are no worse than a row says."""


class NavigationOptions(Strict):
    """What is measured: white noise and biases on all axes, and how often."""

    position_noise_m: NotNegative = 0.0
    velocity_noise_m_s: NotNegative = 0.0
    position_bias_m: Number = 0.0
    velocity_bias_m_s: Number = 0.0
    every: Annotated[Whole, Field(ge=1)] = 1
    """Measurements come every so many periods and are held in between."""


class ThrusterOptions(Strict):
    """What becomes of small demands; the bound is `largest_control` or `spacecraft.thrust_n`."""

    deadband_mm_s2: NotNegative = 0.0
    impulse_bit_n_s: NotNegative = 0.0
    """Smallest impulse, for a spacecraft of `spacecraft.mass_kg`."""


def _truth(value: Any) -> Typed | None:
    if value is None:
        return None
    given = value.model_dump() if isinstance(value, Typed) else value
    factory = factory_of("plants", given)
    if "leader" not in inspect.signature(factory).parameters:
        allowed = "must be motion about a leader (relative_motion, perturbed_relative_motion, tschauner_hempel)"
        raise refuse(refusal(("type",), given["type"], allowed))
    options = typed_options_of(factory, omitted=("leader",)).model_validate(given)
    construct(factory, options)
    return options


class FlightEvaluation(Typed):
    """Flights of laws through stages that come nearer to the truth."""

    type: Literal["flight"]
    laws: dict[str, Annotated[NamedLaw, AfterValidator(_named_law)]] = Field(default_factory=dict)
    """Laws that are flown one after the other, by the names they have in tables; none for `controller`."""
    stages: Annotated[tuple[str, ...], Field(min_length=1)] = STAGES
    band_m: Annotated[Number, Field(gt=0.0)] | dict[str, Annotated[Number, Field(gt=0.0)]] = 100.0
    """The settling band by which flights are judged, one for all starts or by their names."""
    period_s: Annotated[Number, Field(gt=0.0)] = 10.0
    delay: NotNegative = 0.0
    feed: Literal["position", "velocity"] = "velocity"
    memory: Literal["window", "oustaloup", "exponentials"] = "exponentials"
    memory_tolerance: Annotated[Number, Field(gt=0.0, lt=1.0)] = 0.01
    memory_samples: Annotated[Whole, Field(ge=2)] | None = None
    anti_windup: Literal["none", "hold_integrals", "restart"] = "none"
    history_orbits: Annotated[Number, Field(ge=0.0, le=10.0)] = 0.0
    """Of free drift before switch-on, measured as the flight is, which the memory knows."""
    navigation: NavigationOptions = NavigationOptions()
    thrusters: ThrusterOptions = ThrusterOptions()
    largest_control: Positive = None
    """What the thrusters can give, dimensionless; None for any."""
    largest_acceleration_mm_s2: Positive = None
    """The same in mm/s²."""
    largest_by: Literal["norm", "axis"] = "axis"
    """Whether that limits the magnitude or each component."""
    truth: Annotated[SerializeAsAny[Typed] | None, PlainValidator(_truth)] = None
    """Motion from the stage ``nonlinear`` on, a plant about the chief as its leader; None for that of the design."""
    dispersions: Dispersions = Field(default_factory=dict)
    """Distributions by what is uncertain in the stage ``dispersed``."""
    noise_samples: Annotated[Whole, Field(ge=1)] = 50
    """Flights of the stages ``noisy`` and ``nonlinear``."""
    samples: Annotated[Whole, Field(ge=1)] = 500
    """Flights of the stage ``dispersed``."""
    first_sample: Annotated[Whole, Field(ge=0)] = 0
    """Number of the first."""


class ComparedLaw(Typed):
    """A law of a comparison."""

    vary: tuple[str, ...] | None = None
    """Parameters that are searched over; None for all."""
    values: dict[str, Number] = Field(default_factory=dict)
    """Values of the others; their defaults where none are given."""


def _compared_law(value: ComparedLaw) -> ComparedLaw:
    factory_of("controllers", value.model_dump())
    return value


class ComparisonEvaluation(Typed):
    """Several laws on the same problems; goes with the survey of this name."""

    type: Literal["comparison"]
    laws: Annotated[dict[Name, Annotated[ComparedLaw, AfterValidator(_compared_law)]], Field(min_length=1)]
    """`type` and options of each law."""
    reference: str
    """The law that others are compared with."""
    thresholds_m: tuple[Number, ...]
    """Settling bands in metres."""
    gain_limits: tuple[Number, ...] = ()
    """Largest gains."""
    peak_limits_mm_per_s2: tuple[Number, ...] = ()
    """Peak accelerations, with gains up to `widest_gain`."""
    widest_gain: Number = 16.0
    negative_gains: Annotated[bool, Field(strict=True)] = False
    bounds: dict[str, tuple[Number, Number]] = Field(default_factory=dict)
    """[lower, upper] of all varied orders, times and weights."""
    report_periods: tuple[Number, ...] = (2.0, 6.0)
    """Horizons at which the objective is given."""


class SpacecraftOptions(Strict):
    """What flies, for thrust bounds and propellant."""

    mass_kg: Positive = None
    """Mass at time 0."""
    thrust_n: Positive = None
    """Largest thrust, a bound of the control by `evaluation.largest_by`."""
    isp_s: Positive = None
    """Specific impulse."""
