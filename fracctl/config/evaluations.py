"""Schemas of evaluations, and of the spacecraft that they fly."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from fracctl.config.fields import Name, Number, Strict, Typed, Whole, refusal, refuse
from fracctl.config.options import factory_of
from fracctl.dispersions import Distribution
from fracctl.errors import ArgumentError

Positive = Annotated[Number, Field(gt=0.0)] | None
"""A positive number, or nothing."""


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


def _dispersions(value: dict[str, list[Any]]) -> dict[str, list[Any]]:
    lines = []
    for name, given in value.items():
        try:
            Distribution.of(given)
        except ArgumentError as error:
            lines.append(refusal((name,), given, error.allowed))
    if lines:
        raise refuse(*lines)
    return value


class MemoryEvaluation(Typed):
    """Runs of laws with a memory in the loop."""

    type: Literal["memory"]
    laws: dict[str, Annotated[NamedLaw, AfterValidator(_named_law)]] = Field(default_factory=dict)
    """Laws that are run one after the other, by the names they have in tables; none for `controller`."""
    dispersions: Annotated[dict[str, list[Any]], AfterValidator(_dispersions)] = Field(default_factory=dict)
    """Distributions by what is uncertain: ``[normal, mean, deviation]``, ``[uniform, from, to]``, ``[choice, …]``."""
    samples: Annotated[Whole, Field(ge=1)] = 200
    """How many are drawn where there are distributions."""
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
