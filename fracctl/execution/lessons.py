"""What an optimum teaches beside its value: sentences for the summary.

An optimum at the end of what was searched may not be the best; one that small changes of the gains spoil may not fly;
and a settling time implies a thrust.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Floats
from fracctl.controllers.parameters import Parameter
from fracctl.evaluation import Evaluation
from fracctl.measures import PeakAcceleration, SettlingTime
from fracctl.surveys import axis_values

OFF = 0.05
"""By which each gain is changed: the step of the paper's grids."""
_AT_THE_END = 1e-6
"""Of the width of what was searched."""
_TOLD = 0.05
"""Smaller changes of the settling time, in per cent, are not told."""


def lessons(
    evaluation: Evaluation, configuration: Mapping[str, Any], found: Iterable[Mapping[str, Any]]
) -> Iterator[str]:
    """Yield sentences on the primary objective's optima.

    Args:
        evaluation: solves the optima again, where they are those of linear loops.
        configuration: of the run; `survey` and `spacecraft` are read.
        found: results by objective and initial condition, with their `optimum`.
    """
    survey = configuration.get("survey") or {}
    searches = survey.get("axes") or survey.get("bounds")
    searched = dict(_searched(survey, _parameters(evaluation))) if searches else {}
    mass = (configuration.get("spacecraft") or {}).get("mass_kg")
    for result in found:
        optimum = result["optimum"]
        if optimum is None or result["objective_name"] != evaluation.objective:
            continue
        where = f"{result['initial_condition']}, {evaluation.objective}"
        yield from (f"{where}: {sentence}" for sentence in _ends(optimum, searched))
        if evaluation.has_poles:
            said = [*_sensitivity(evaluation, optimum), *_peak(evaluation, optimum, mass)]
            if said:
                yield f"{where}: {'; '.join(said)}"


def _parameters(evaluation: Evaluation) -> list[Parameter]:
    return list(evaluation.law.parameters(evaluation.plant.components))


def _searched(survey: Mapping[str, Any], parameters: Sequence[Parameter]) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Yield by design variable its parameter, the ends of what was searched, and the key that holds them."""
    axes, bounds = survey.get("axes") or {}, survey.get("bounds") or {}
    for parameter in parameters:
        name, kind = parameter.name, f"{parameter.kind}s"
        if name in axes:
            values = axis_values(axes[name], name)
            if len(values) > 2:  # two are a choice, not a search
                yield name, (parameter, float(values.min()), float(values.max()), f"survey.axes.{name}")
        elif isinstance(bounds, Mapping) and (name in bounds or kind in bounds):
            key = name if name in bounds else kind
            yield name, (parameter, *map(float, bounds[key]), f"survey.bounds.{key}")
        elif not isinstance(bounds, Mapping) and parameter.kind == "gain":
            yield name, (parameter, *map(float, bounds), "survey.bounds")


def _ends(optimum: Mapping[str, Any], searched: Mapping[str, tuple[Any, ...]]) -> Iterator[str]:
    """Yield which variables lie at an end that could be moved."""
    for name, (parameter, lower, upper, key) in searched.items():
        value, near = float(optimum[name]), _AT_THE_END * (upper - lower)
        for end, furthest, way in ((lower, parameter.lower, "lower"), (upper, parameter.upper, "upper")):
            if abs(value - end) <= near and end != furthest:
                yield f"{name} = {value:g} is the {way} end of {key}; a wider one may hold a better optimum"


def _sensitivity(evaluation: Evaluation, optimum: Mapping[str, Any]) -> Iterator[str]:
    """Yield how much the settling time changes where one gain is off."""
    measures: tuple[Any, ...] = evaluation.measures
    measure = next((measure for measure in measures if isinstance(measure, SettlingTime)), None)
    settled = optimum.get(SettlingTime.name)
    if measure is None or settled is None or not math.isfinite(settled):
        return
    gains = [parameter.name for parameter in _parameters(evaluation) if parameter.kind == "gain"]
    if not gains:
        return
    changes = [(name, sign) for name in gains for sign in (OFF, -OFF)]
    design = {name: np.full(1 + len(changes), float(optimum[name])) for name in evaluation.design_variables}
    for place, (name, change) in enumerate(changes, start=1):
        design[name][place] += change
    times = _settling_times(evaluation, measure, design, str(optimum["initial_condition"]))
    if not abs(times[0] - settled) <= 1e-6 * settled:
        return  # the row is not that of the nominal loop
    percent = 100.0 * (times[1:] / times[0] - 1.0)
    name, change = changes[int(np.argmax(np.abs(percent)))]
    worst = f"{name} {'+' if change > 0.0 else '-'} {OFF:g}"
    if math.isinf(np.abs(percent).max()):
        yield f"with one gain off by {OFF:g} it may not settle ({worst})"
    elif np.abs(percent).max() > _TOLD:
        span = f"{percent.min():+.1f} to {percent.max():+.1f} %"
        yield f"with one gain off by {OFF:g} the settling time changes by {span} (most with {worst})"


def _settling_times(evaluation: Evaluation, measure: Any, design: Mapping[str, Floats], condition: str) -> Floats:
    """The settling times of design points from one start, infinite where there is none."""
    nominal = Evaluation(
        evaluation.plant,
        evaluation.law,
        evaluation.parameters,
        {condition: evaluation.initial_conditions[condition]},
        evaluation.solver,
        (measure,),
        {measure.name: (measure.name,)},
        measure.name,
        evaluation.horizon,
    )
    rows = nominal(design)
    return np.where(rows["status"] == "ok", rows[measure.name], np.inf)


def _peak(evaluation: Evaluation, optimum: Mapping[str, Any], mass_kg: float | None) -> Iterator[str]:
    """Yield the largest acceleration of an axis, and the force that it takes."""
    scales = evaluation.plant.scales
    if scales is None:
        return
    design = {name: float(optimum[name]) for name in evaluation.design_variables}
    trajectory = evaluation.solve(design, str(optimum["initial_condition"]))
    peak = float(PeakAcceleration()(trajectory)[PeakAcceleration.name][0]) * scales.acceleration_m_s2
    force = "" if mass_kg is None else f", {mass_kg * peak:.3g} N for {mass_kg:g} kg"
    yield f"the control peaks at {1e3 * peak:.3g} mm/s²{force}"
