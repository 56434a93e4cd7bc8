"""A run in words: every part with its numbers and, where the plant has scales, in SI units."""

from __future__ import annotations

import inspect
import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from fracctl.comparison import ComparisonEvaluation as ComparisonEvaluated
from fracctl.config import registry
from fracctl.config.schemas import GridSurvey, RunConfig, SingleSurvey
from fracctl.evaluation import Evaluation
from fracctl.plants import LinearPlant
from fracctl.plants.capabilities import ChiefPlant
from fracctl.report.numbers import count, number
from fracctl.store import directory_of
from fracctl.surveys import Survey, axis_values
from fracctl.surveys.base import SEARCHED_FOR
from fracctl.units import Scales

_Row = tuple[str, str]
_DRAWN = ("dispersions", "samples", "first_sample")


def explain(config: RunConfig, evaluation: Evaluation, survey: Survey) -> list[_Row]:
    """Return name and text of every part of a run; a part of several lines has its name on the first."""
    return [
        *_plant(config, evaluation.plant),
        *_spacecraft(config),
        *_law(config, evaluation),
        *_initial_conditions(evaluation),
        ("horizon", _time(evaluation.horizon, evaluation.plant.scales)),
        ("solver", _sentence(evaluation.solver, config.solver.type, _options(config.solver))),
        ("evaluation", _sentence(evaluation, config.evaluation.type, _evaluated(config))),
        *_measures(config, evaluation),
        *_objectives(evaluation),
        *_constraints(config),
        *_survey(config, evaluation, survey),
        ("scheduler", _scheduler(config)),
        ("figures", ", ".join(config.figures) or "none"),
        ("stored in", str(directory_of(config.model_dump(mode="json")).path)),
    ]


def parts(config: RunConfig, evaluation: Evaluation, survey: Survey) -> dict[str, Any]:
    """Return the same as plain data: `run_directory`, `words` by what they explain, and the `configuration`."""
    words: dict[str, list[str]] = {}
    for name, text in explain(config, evaluation, survey):
        words.setdefault(name or next(reversed(words)), []).append(text)
    plain = config.model_dump(mode="json")
    return {"run_directory": str(directory_of(plain).path), "words": words, "configuration": plain}


def _evaluated(config: RunConfig) -> str:
    bounds = [getattr(config.evaluation, name, None) for name in ("largest_control", "largest_acceleration_mm_s2")]
    unlimited = all(bound is None for bound in (*bounds, config.spacecraft.thrust_n))
    certain = not getattr(config.evaluation, "dispersions", None)
    hidden = ["laws", *(["largest_by"] if unlimited else []), *(_DRAWN if certain else ())]
    return _options(config.evaluation, hidden=hidden)


def _spacecraft(config: RunConfig) -> Iterator[_Row]:
    if text := _options(config.spacecraft):
        yield "spacecraft", text


def _plant(config: RunConfig, plant: LinearPlant) -> Iterator[_Row]:
    yield "plant", _sentence(plant, config.plant.type, "")
    if isinstance(plant, ChiefPlant):
        orbit = f"circular orbit, radius {number(plant.chief.a_km)} km"
        yield "", f"chief on a {orbit}, inclination {number(plant.chief.inclination_deg)}°"
    scales = plant.scales
    if scales is None:
        yield "", "dimensionless; T = 2π"
        return
    units = f"length {number(scales.length_m)} m, time {number(scales.time_s)} s"
    yield "", f"1 stands for {units}, speed {number(scales.speed_m_s)} m/s"
    acceleration = f"acceleration {number(scales.acceleration_m_s2)} m/s²"
    yield "", f"{acceleration}; one period T = 2π = {number(scales.period_s / 3600.0)} h"


def _law(config: RunConfig, evaluation: Evaluation) -> Iterator[_Row]:
    if laws := getattr(config.evaluation, "laws", None):
        for place, (name, law) in enumerate(laws.items()):
            values = ", ".join(f"{parameter} {number(value)}" for parameter, value in law.values.items())
            yield "" if place else "compares", _sentence(registry.load("controllers", law.type), name, values)
        return
    decided = getattr(config.evaluation, "delay_from", "given") != "given"
    names = [name for name in evaluation.design_variables if not (decided and name == "delay")]
    yield "controller", _sentence(evaluation.law, config.controller.type, "")
    for equation in _equation(evaluation.law):
        yield "", equation
    yield "", ", ".join(f"{name} = {number(evaluation.parameters[name])}" for name in names)
    yield from _derivative_gains(evaluation)
    yield from _delays(config, evaluation)


def _derivative_gains(evaluation: Evaluation) -> Iterator[_Row]:
    """Gains of fractional derivatives of single components in their odd unit, s^(α-2)."""
    scales, values = evaluation.plant.scales, evaluation.parameters
    if scales is None:
        return
    for component in evaluation.plant.components:
        order, gain = values.get(f"alpha_{component}", 1.0), values.get(f"k_d_{component}")
        if gain is not None and order < 1.0:
            value = gain * scales.time_s ** (order - 2.0)
            yield "", f"k_d_{component} is {number(value)} s^({number(order - 2.0)}) in SI units"


def _delays(config: RunConfig, evaluation: Evaluation) -> Iterator[_Row]:
    """The delay of every start, where it is not a parameter of the law."""
    source = getattr(config.evaluation, "delay_from", "given")
    if source == "given":
        return
    delays: Mapping[str, float] = evaluation.delays  # type: ignore[attr-defined]
    what = {"period": "the period of the plant", "first_return": "the first return of the free motion"}[source]
    values = {name: f"{number(delay)} = {_time(delay, evaluation.plant.scales)}" for name, delay in delays.items()}
    if len(set(values.values())) == 1:
        yield "delay", f"{next(iter(values.values()))}, {what}"
        return
    yield "delay", what
    for name, text in values.items():
        yield "", f"{name}: {text}"


def _initial_conditions(evaluation: Evaluation) -> Iterator[_Row]:
    plant = evaluation.plant
    for place, (name, state) in enumerate(evaluation.initial_conditions.items()):
        values = zip(plant.state_names, state.tolist(), strict=True)
        text = ", ".join(f"{state} = {_state(state, value, plant.scales)}" for state, value in values if value)
        yield "" if place else "starts from", f"{name}: {text}"


def _measures(config: RunConfig, evaluation: Evaluation) -> Iterator[_Row]:
    for place, (name, options) in enumerate(config.measures.items()):
        text = _options(options)
        threshold = getattr(options, "threshold", None) if name == "settling_time" else None
        if evaluation.plant.scales is not None and isinstance(threshold, float):
            text += f" ({number(threshold * evaluation.plant.scales.length_m)} m)"
        yield "" if place else "measures", _sentence(registry.load("measures", name), name, text)


def _objectives(evaluation: Evaluation) -> Iterator[_Row]:
    if isinstance(evaluation, ComparisonEvaluated):
        yield "minimises", " · ".join(evaluation.factors) + (" (geometric mean)" if len(evaluation.factors) > 1 else "")
    names = sorted(evaluation.objectives, key=lambda name: name != evaluation.objective)
    for place, name in enumerate(names):
        factors = evaluation.objectives[name]
        mean = f" = ({' · '.join(factors)})^(1/{len(factors)})" if len(factors) > 1 else ""
        yield "" if place else "minimises", f"{name}{mean}" + ("" if place else " (primary)")


def _constraints(config: RunConfig) -> Iterator[_Row]:
    for place, (name, text) in enumerate(config.constraints.items()):
        yield "" if place else "optima have", f"{name} {text}"


def extent(survey: Survey) -> str:
    """Return how many design points or searches a survey asks for."""
    if SEARCHED_FOR in survey.columns:
        return "as many searches as it needs" if survey.n_points is None else count(survey.n_points, "search", "es")
    return "as many design points as it needs" if survey.n_points is None else count(survey.n_points, "design point")


def _survey(config: RunConfig, evaluation: Evaluation, survey: Survey) -> Iterator[_Row]:
    conditions = count(len(evaluation.initial_conditions), "initial condition")
    yield "survey", f"{config.survey.type}: {extent(survey)}, {conditions}"
    if not isinstance(config.survey, GridSurvey | SingleSurvey):
        yield "", _described(survey)
        yield "", _options(config.survey, hidden=("axes", "start"))
    for name, spec in getattr(config.survey, "axes", {}).items():
        values = axis_values(spec, name)
        yield "", f"{name} from {number(values[0])} to {number(values[-1])}, {count(len(values), 'value')}"
    if survey.slices and evaluation.objectives:
        yield "", f"the best point is kept for each {' and '.join(survey.slices)}"
    if survey.baseline:
        wanted = ", ".join(f"{name} = {number(value)}" for name, value in survey.baseline.items())
        yield "", f"compared with the best point of {wanted}"


def _scheduler(config: RunConfig) -> str:
    if config.scheduler.type == "serial":
        return "serial: in this process"
    if address := getattr(config.scheduler, "address", None):
        return f"dask: the workers of {address}"
    workers = getattr(config.scheduler, "workers", None)
    limit = getattr(config.scheduler, "time_limit", None)
    end = f"; a block may take {number(limit)} s" if limit else ""
    return f"{config.scheduler.type}: {workers or 'as many worker processes as cores'}{end}"


def _described(thing: Any) -> str:
    """The first sentence of a docstring."""
    return (inspect.getdoc(thing) or "").partition("\n")[0].rstrip(".")


def _sentence(thing: Any, name: str, options: str) -> str:
    """Name, options, and the first sentence of a docstring."""
    described = _described(thing)
    return f"{name}" + (f", {options}" if options else "") + (f": {described}" if described else "")


def _equation(thing: Any) -> list[str]:
    """The first displayed equation of a docstring, if any."""
    lines = (inspect.getdoc(thing) or "").partition("Args:")[0].splitlines()
    return [line.partition("  (")[0].strip() for line in lines if line.startswith("    ")][:1]


def _options(options: Any, hidden: Collection[str] = ()) -> str:
    given: Mapping[str, Any] = options.model_dump(exclude={"type", *hidden})
    return ", ".join(f"{name} {_option(value)}" for name, value in given.items() if value is not None)


def _option(value: Any) -> str:
    if isinstance(value, Mapping):
        return "(" + ", ".join(f"{name} {_option(entry)}" for name, entry in value.items()) + ")"
    return f"[{', '.join(map(_option, value))}]" if isinstance(value, list | tuple) else number(value)


def _time(value: float, scales: Scales | None) -> str:
    hours = "" if scales is None else f" = {number(value * scales.time_s / 3600.0)} h"
    return f"{number(value / (2.0 * math.pi))} T{hours}"


def _state(name: str, value: float, scales: Scales | None) -> str:
    if scales is None:
        return number(value)
    rate = name.endswith("_dot")
    unit = scales.speed_m_s if rate else scales.length_m
    return f"{number(value)} ({number(value * unit)} {'m/s' if rate else 'm'})"
