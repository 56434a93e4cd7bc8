"""The schema of a run: what a configuration holds, with every error found at once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, SerializeAsAny, ValidationInfo
from pydantic_core import InitErrorDetails

from fracctl.config import parts
from fracctl.config.fields import Folder, Name, Number, Strict, Typed, Whole, refusal, refuse, unknown
from fracctl.config.options import factory_of
from fracctl.dispersions import Distribution
from fracctl.errors import ArgumentError, suggestion
from fracctl.measures.limits import limit

_COLUMN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class SingleSurvey(Typed):
    """One design point: the controller as it stands."""

    type: Literal["single"]


class GridSurvey(Typed):
    """The product of axes."""

    type: Literal["grid"]
    axes: dict[str, Any]
    """``start:stop:step``, a number, or a list of values, by design variable."""
    slice: str | None = None
    """The design variable for each value of which an optimum is stored."""
    baseline: dict[str, Number] = Field(default_factory=dict)
    """Values that the point has with which the optimum is compared."""


LargestControl = Annotated[Number, Field(gt=0.0)] | None


class PerformanceEvaluation(Typed):
    """Measures of trajectories, and objectives."""

    type: Literal["performance"] = "performance"
    largest_control: LargestControl = None
    """What the thrusters can give, dimensionless; None for any."""
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
    largest_control: LargestControl = None
    """What the thrusters can give, dimensionless; None for any."""
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


class SerialScheduler(Typed):
    """Everything in the calling process."""

    type: Literal["serial"] = "serial"


class LocalScheduler(Typed):
    """Worker processes on this machine."""

    type: Literal["local"] = "local"
    workers: Annotated[Whole, Field(ge=1)] | None = None
    """How many; None for one a core."""


class Figure(Typed):
    """One figure of the run."""

    type: Literal[
        "gain_contours",
        "trajectories",
        "objective_against_order",
        "order_contours",
        "pareto_fronts",
        "poles",
        "bode",
        "nyquist",
        "work_precision",
        "settling_against_band",
        "settling_against_effort",
        "orbits",
        "feedback",
        "drift",
        "multiplier_window",
        "deployment",
        "settling_against_overshoot",
        "spread",
    ]
    objective: str | None = None
    """Whose optima are shown; None for the primary one."""
    initial_conditions: list[str] | None = None
    """Which are shown; None for all."""
    shows: str | None = None
    """What figures that can show several things show."""


SURVEYS: Mapping[str, type[Typed]] = {"single": SingleSurvey, "grid": GridSurvey}
EVALUATIONS: Mapping[str, type[Typed]] = {
    "performance": PerformanceEvaluation,
    "accuracy": AccuracyEvaluation,
    "comparison": ComparisonEvaluation,
    "delayed": DelayedEvaluation,
    "memory": MemoryEvaluation,
}
SCHEDULERS: Mapping[str, type[Typed]] = {"serial": SerialScheduler, "local": LocalScheduler}


def _survey(value: Any, info: ValidationInfo) -> Typed:
    return parts.survey(value, info, SURVEYS)


def _scheduler(value: Any) -> Typed:
    return _one_of(SCHEDULERS, value)


def _evaluation(value: Any) -> Typed:
    options = _one_of(EVALUATIONS, value)
    if isinstance(options, AccuracyEvaluation):
        lines = parts.setting_lines(options.model_dump(include={"contour", "volterra", "collocation"}))
        if lines:
            raise refuse(*lines)
    return options


def _one_of(kinds: Mapping[str, type[Typed]], value: Any) -> Typed:
    given = parts.plain(value)
    name = given.get("type") if isinstance(given, Mapping) else None
    if name not in kinds:
        hint = suggestion(str(name), kinds)
        raise refuse(refusal(("type",), name, f"must be one of {', '.join(kinds)}{hint}"))
    return kinds[str(name)].model_validate(given)


def _objectives(value: dict[str, list[str]], info: ValidationInfo) -> dict[str, list[str]]:
    columns = parts.measure_columns(info.data["measures"]) if "measures" in info.data else None
    lines = []
    for name, factors in value.items():
        if not _COLUMN.fullmatch(name):
            allowed = "an objective's name consists of letters, digits and '_'"
            lines.append(refusal((name,), factors, allowed, "sentence"))
        if not factors:
            lines.append(refusal((name,), factors, "must name at least one measure"))
        for factor in factors:
            if columns is not None and factor not in columns:
                allowed = f"must name measures of this run ({', '.join(columns)}){suggestion(factor, columns)}"
                lines.append(refusal((name,), factors, allowed))
    if not value:
        lines.append(refusal((), value, "must hold at least one objective"))
    if lines:
        raise refuse(*lines)
    return value


def _constraints(value: dict[str, str], info: ValidationInfo) -> dict[str, str]:
    columns = parts.measure_columns(info.data["measures"]) if "measures" in info.data else None
    lines = []
    for name, text in value.items():
        if columns is not None and name not in columns:
            lines.append(unknown((name,), text, columns))
        try:
            limit(text)
        except ArgumentError as error:
            lines.append(refusal((name,), text, error.allowed))
    if lines:
        raise refuse(*lines)
    return value


def _objective(value: str, info: ValidationInfo) -> str:
    lines = _absent("objectives", value, (), info)
    if lines:
        raise refuse(*lines)
    return value


def _figures(value: dict[str, Figure], info: ValidationInfo) -> dict[str, Figure]:
    lines = []
    for name, figure in value.items():
        if figure.objective is not None:
            lines += _absent("objectives", figure.objective, (name, "objective"), info)
        for condition in figure.initial_conditions or ():
            lines += _absent("initial_condition", condition, (name, "initial_conditions"), info)
    if lines:
        raise refuse(*lines)
    return value


def _absent(field: str, name: str, path: tuple[str, ...], info: ValidationInfo) -> list[InitErrorDetails]:
    """An error if a field has no entry of this name."""
    known = list(info.data.get(field, [name]))
    what = "objectives" if field == "objectives" else "initial conditions"
    allowed = f"must be one of the run's {what} ({', '.join(known)})"
    return [] if name in known else [refusal(path, name, allowed)]


Part = SerializeAsAny[Typed]
Options = SerializeAsAny[Strict]


class RunConfig(Strict):
    """One run. `model_dump(mode="json")` is plain data from which `model_validate` gives the same object."""

    plant: Annotated[Part, PlainValidator(parts.registered)]
    """`type` and the options of the plant."""
    controller: Annotated[Part, PlainValidator(parts.controller)]
    """`type` and the parameters of the law, which are columns of the tables."""
    initial_condition: Annotated[
        dict[Name, Annotated[Options, PlainValidator(parts.initial_condition)]], Field(min_length=1)
    ]
    """`units` and values of the states, by name."""
    solver: Annotated[Part, PlainValidator(parts.registered)]
    """`type` and the options of the solver."""
    measures: Annotated[dict[str, Options], PlainValidator(parts.measures)]
    """Options of the measures, by name."""
    objectives: Annotated[dict[str, list[str]], AfterValidator(_objectives)]
    """Measure columns by the name of the objective that is their geometric mean."""
    objective: Annotated[str, AfterValidator(_objective)]
    """The primary one."""
    constraints: Annotated[dict[str, str], AfterValidator(_constraints)] = Field(default_factory=dict)
    """``>= number`` or ``<= number`` by measured column; a point that breaks one is no optimum."""
    survey: Annotated[Part, PlainValidator(_survey)]
    """Which design points are evaluated."""
    evaluation: Annotated[Part, PlainValidator(_evaluation)] = PerformanceEvaluation()
    """What is computed of each."""
    scheduler: Annotated[Part, PlainValidator(_scheduler)] = SerialScheduler()
    """Where."""
    figures: Annotated[dict[Name, Figure], AfterValidator(_figures)] = Field(default_factory=dict)
    """By file name."""
    horizon_periods: Annotated[Number, Field(gt=0.0)] = 6.0
    """Simulated time in units of 2π."""
    name: Name = "custom"
    """Folder of the runs in `output_dir`."""
    output_dir: Folder = "outputs"
    """Relative to the current directory."""
    seed: Annotated[Whole, Field(ge=0)] = 0
    """Of everything random."""
