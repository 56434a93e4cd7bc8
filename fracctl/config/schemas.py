"""The schema of a run: what a configuration holds, with every error found at once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, SerializeAsAny, ValidationInfo, model_validator
from pydantic_core import InitErrorDetails

from fracctl.config import parts, registry
from fracctl.config.cluster import DaskScheduler
from fracctl.config.evaluations import (
    AccuracyEvaluation,
    ComparisonEvaluation,
    DelayedEvaluation,
    FlightEvaluation,
    MemoryEvaluation,
    PerformanceEvaluation,
    Positive,
    RobustEvaluation,
    SpacecraftOptions,
)
from fracctl.config.fields import Folder, Name, Number, Strict, Typed, Whole, refusal, refuse, unknown
from fracctl.config.options import named_factory
from fracctl.errors import ArgumentError, suggestion
from fracctl.measures.limits import limit

HORIZONS = ("horizon_periods", "horizon_min", "horizon_s")
"""Keys of the simulated time; one of them is given."""

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


class SerialScheduler(Typed):
    """Everything in the calling process."""

    type: Literal["serial"] = "serial"

    @model_validator(mode="before")
    @classmethod
    def _without_limit(cls, data: Any) -> Any:
        """Refuse a time limit: a process cannot leave what it is computing itself."""
        given = data.get("time_limit") if isinstance(data, Mapping) else None
        if given is not None:
            allowed = "only worker processes can be stopped in the middle of a block; use scheduler=local"
            raise refuse(refusal(("time_limit",), given, allowed))
        return data


class LocalScheduler(Typed):
    """Worker processes on this machine."""

    type: Literal["local"] = "local"
    workers: Annotated[Whole, Field(ge=1)] | None = None
    """How many; None for one a core."""
    time_limit: Positive = None
    """Seconds that a block may take before its worker is killed; None for no limit."""


def _figure_type(value: str) -> str:
    known = registry.names("figures")
    if value not in known:
        raise refuse(refusal((), value, f"must be one of {', '.join(known)}{suggestion(value, known)}"))
    return value


class Figure(Typed):
    """One figure of the run."""

    type: Annotated[str, AfterValidator(_figure_type)]
    objective: str | None = None
    """Whose optima are shown; None for the primary one."""
    initial_conditions: Annotated[list[str], Field(min_length=1)] | None = None
    """Which are shown; None for all."""
    shows: str | None = None
    stage: str | None = None
    """Of flights, the stage that is shown; None for the last."""
    """What figures that can show several things show."""


SURVEYS: Mapping[str, type[Typed]] = {"single": SingleSurvey, "grid": GridSurvey}
EVALUATIONS: Mapping[str, type[Typed]] = {
    "performance": PerformanceEvaluation,
    "accuracy": AccuracyEvaluation,
    "comparison": ComparisonEvaluation,
    "delayed": DelayedEvaluation,
    "memory": MemoryEvaluation,
    "robust": RobustEvaluation,
    "flight": FlightEvaluation,
}
SCHEDULERS: Mapping[str, type[Typed]] = {
    "serial": SerialScheduler,
    "local": LocalScheduler,
    "dask": DaskScheduler,
}


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
        if figure.shows is not None:
            lines += _shows_lines(name, figure.type, figure.shows, info)
    if lines:
        raise refuse(*lines)
    return value


def _shows_lines(name: str, kind: str, shows: str, info: ValidationInfo) -> list[InitErrorDetails]:
    """Errors of what a figure shall show: its builder says what it can, words of its own or measures of the run."""
    able = getattr(named_factory("figures", kind, (name, "type")), "shows", ())
    if able is None and "measures" not in info.data:
        return []
    known = parts.measure_columns(info.data["measures"]) if able is None else able
    if not known:
        return [refusal((name, "shows"), shows, f"figures of type {kind} have nothing to choose; leave it out")]
    wanted = [word.strip() for word in shows.split(",")] if able is None else [shows]
    wrong = [word for word in wanted if word not in known]
    every = f" ({', '.join(known)})"
    return [
        refusal((name, "shows"), shows, f"must name what the figure can show{suggestion(word, known) or every}")
        for word in wrong
    ]


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
    spacecraft: SpacecraftOptions = SpacecraftOptions()
    """Mass, thrust and specific impulse."""
    horizon_periods: Positive = 6.0
    """Simulated time in units of 2π."""
    horizon_min: Positive = None
    """The same in minutes."""
    horizon_s: Positive = None
    """The same in seconds."""
    name: Name = "custom"
    """Folder of the runs in `output_dir`."""
    output_dir: Folder = "outputs"
    """Relative to the current directory."""
    seed: Annotated[Whole, Field(ge=0)] = 0
    """Of everything random."""

    @model_validator(mode="after")
    def _one_horizon(self) -> RunConfig:
        given = [name for name in HORIZONS if getattr(self, name) is not None]
        if len(given) != 1:
            others = " and ".join(given) if given else "none"
            cure = f"; set {' and '.join(f'{name}=null' for name in given[:-1])}" if given else ""
            allowed = f"one of {', '.join(HORIZONS)} must be given, but {others} are{cure}"
            raise refuse(refusal((given[-1] if given else HORIZONS[0],), None, allowed, "sentence"))
        return self
