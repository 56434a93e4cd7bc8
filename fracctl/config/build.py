"""From a validated configuration to the objects of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from pydantic import ValidationError

from fracctl.arrays import Floats
from fracctl.config import flight, registry
from fracctl.config.evaluations import AccuracyEvaluation, ComparisonEvaluation
from fracctl.config.evaluations import DelayedEvaluation as DelayedOptions
from fracctl.config.evaluations import FlightEvaluation as FlightOptions
from fracctl.config.evaluations import MemoryEvaluation as MemoryOptions
from fracctl.config.evaluations import RobustEvaluation as RobustOptions
from fracctl.config.fields import lines_of, refuse
from fracctl.config.messages import InvalidConfiguration, problems
from fracctl.config.options import construct
from fracctl.config.schemas import GridSurvey, RunConfig, SingleSurvey
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.evaluation import LAW_NUMBER, Evaluation
from fracctl.measures.base import TRAJECTORIES, LoopMeasure, trajectories_of
from fracctl.measures.limits import limit
from fracctl.plants import LinearPlant
from fracctl.surveys import Grid, Single, Survey, axis_values

_TRAJECTORIES = {"delayed": "StepwiseTrajectory", "memory": "MeshTrajectory"}
_OF_LOOPS = ("performance", "robust")
"""Evaluations that measure loops and keep to constraints."""
_OPTIMISING = ("search", "pattern_search", "continuation")
"""Surveys that look for the best point."""
_OWN_SOLVERS = {"delayed": "method_of_steps", "memory": "implicit_memory"}


def build_evaluation(config: RunConfig) -> Evaluation:
    """Return what turns design points into rows."""
    plant = build_plant(config)
    common: dict[str, Any] = {
        "plant": plant,
        "law": registry.load("controllers", config.controller.type),
        "parameters": build_parameters(config),
        "initial_conditions": build_initial_conditions(config, plant),
        "solver": construct(registry.load("solvers", config.solver.type), config.solver),
        "horizon": flight.horizon(config, plant.scales),
    }
    craft, limit_of_control = flight.spacecraft(config), flight.saturation(config, plant.scales)
    if isinstance(config.evaluation, AccuracyEvaluation):
        from fracctl import accuracy  # loads all solvers

        options = config.evaluation.model_dump(exclude={"type"})
        return accuracy.AccuracyEvaluation(**common, measures=(), objectives={}, objective="", **options)
    made = [
        flight.in_units(name, construct(registry.load("measures", name), options), plant, craft)
        for name, options in config.measures.items()
    ]
    measures: tuple[Any, ...] = tuple(measure for measure in made if not isinstance(measure, LoopMeasure))
    if isinstance(config.evaluation, ComparisonEvaluation):
        return _comparison(config, config.evaluation, common | {"measures": measures})
    common |= {
        "measures": measures,
        "objectives": {name: tuple(columns) for name, columns in config.objectives.items()},
        "objective": config.objective,
    }
    given = config.evaluation
    if isinstance(given, MemoryOptions):
        return _memory(given, config.seed, common)
    if isinstance(given, FlightOptions):
        return _flight(config, given, common)
    common["saturation"] = limit_of_control
    if isinstance(given, DelayedOptions):
        return _delayed(given, common)
    common["loop_measures"] = tuple(measure for measure in made if isinstance(measure, LoopMeasure))
    common["constraints"] = {column: limit(text) for column, text in config.constraints.items()}
    return _robust(config, given, common) if isinstance(given, RobustOptions) else Evaluation(**common)


def _robust(config: RunConfig, given: RobustOptions, common: Mapping[str, Any]) -> Evaluation:
    from fracctl.flight import RobustEvaluation

    dispersions = flight.distributions(given)
    options = given.model_dump(exclude={"type", "dispersions"}) | {"seed": config.seed}
    sizes = flight.start_sizes(config, common["plant"])
    try:
        return RobustEvaluation(**common, dispersions=dispersions, sizes=sizes, **options)
    except ArgumentError as error:
        raise _refused(error) from error


def _refused(error: ArgumentError) -> ConfigurationError:
    """Return what an evaluation refuses under the key of the configuration."""
    elsewhere = error.name.startswith(("measures", "plant", "solver"))
    where = error.name if elsewhere else f"evaluation.{error.name}"
    cure = f"; {error.instead}" if error.instead else ""
    return ConfigurationError(f"{where} = {error.value}: {error.allowed}{cure}")


def _delayed(given: DelayedOptions, common: Mapping[str, Any]) -> Evaluation:
    from fracctl.delayed_evaluation import DelayedEvaluation  # loads the solver

    try:
        return DelayedEvaluation(**common, delay_from=given.delay_from)
    except ArgumentError as error:
        cure = f"; {error.instead}" if error.instead else ""
        raise ConfigurationError(f"{error.name} = {error.value}: {error.allowed}{cure}") from error


def _memory(given: MemoryOptions, seed: int, common: Mapping[str, Any]) -> Evaluation:
    from fracctl.memory_evaluation import MemoryEvaluation  # loads the solver

    laws = _named_laws(given.laws)
    dispersions = flight.distributions(given)
    options = {"laws": laws, "dispersions": dispersions, "samples": given.samples, "first_sample": given.first_sample}
    nothing: dict[str, Any] = {"objectives": {}, "objective": ""} if dispersions else {}
    try:
        return MemoryEvaluation(**{**common, **nothing}, **options, seed=seed)  # type: ignore[arg-type]
    except ArgumentError as error:
        raise _refused(error) from error


def _flight(config: RunConfig, given: FlightOptions, common: Mapping[str, Any]) -> Evaluation:
    from fracctl.flight import FlightEvaluation, Sampling  # loads the sampled laws

    plant, laws = common["plant"], _named_laws(given.laws)
    options = {name: getattr(given, name) for name in ("stages", "band_m", "noise_samples", "samples", "first_sample")}
    try:
        sampling = Sampling(**{field.name: getattr(given, field.name) for field in fields(Sampling)})
        around = flight.surroundings(config, given, plant)
        free = {**common, "objectives": {}, "objective": "", "sizes": flight.start_sizes(config, plant)}
        return FlightEvaluation(**free, laws=laws, sampling=sampling, surroundings=around, seed=config.seed, **options)
    except ArgumentError as error:
        raise _refused(error) from error


def _named_laws(given: Mapping[str, Any]) -> dict[str, Any]:
    from fracctl.memory_evaluation import NamedLaw

    return {name: NamedLaw(registry.load("controllers", law.type), law.values) for name, law in given.items()}


def _comparison(config: RunConfig, given: ComparisonEvaluation, common: Mapping[str, Any]) -> Evaluation:
    from fracctl import comparison  # loads the laws and the searches

    laws = {
        name: comparison.ComparedLaw(registry.load("controllers", law.type), law.vary, law.values)
        for name, law in given.laws.items()
    }
    options = {name: value for name, value in given if name not in ("type", "laws")}
    factors = tuple(config.objectives[config.objective])
    try:
        return comparison.ComparisonEvaluation(
            **common, objectives={}, objective="", factors=factors, laws=laws, **options
        )
    except ArgumentError as error:
        raise _refused(error) from error


def build_survey(config: RunConfig, evaluation: Evaluation) -> Survey:
    """Return what decides which design points are evaluated.

    Raises:
        ConfigurationError: an option does not fit the rest of the run.
    """
    parameters = evaluation.parameters
    survey = config.survey
    if isinstance(config.evaluation, ComparisonEvaluation) and survey.type != "comparison":
        raise ConfigurationError(f"survey.type = {survey.type}: must be comparison with evaluation=comparison")
    if isinstance(survey, SingleSurvey) and not evaluation.axes:
        return Single({name: parameters[name] for name in evaluation.design_variables})
    if isinstance(survey, SingleSurvey | GridSurvey):
        grid = survey if isinstance(survey, GridSurvey) else GridSurvey(type="grid", axes={})
        if grid.axes:
            _refuse_several_laws(config, "survey.axes")
        axes = {name: axis_values(spec, name) for name, spec in grid.axes.items()} | dict(evaluation.axes)
        fixed = {name: parameters[name] for name in evaluation.design_variables if name not in axes}
        return Grid(axes, grid.slice or evaluation.sliced_by, grid.baseline, fixed)
    if survey.type in _OPTIMISING:
        _check_optimisable(config, evaluation)
    factory = registry.load("surveys", survey.type)
    try:
        built: Survey = construct(factory, survey, evaluation=evaluation, seed=config.seed)
    except ValidationError as error:
        raise InvalidConfiguration(problems(refuse(*lines_of(error, ("survey",))))) from error
    return built


def _check_optimisable(config: RunConfig, evaluation: Evaluation) -> None:
    place = f"survey.type = {config.survey.type}"
    if not evaluation.objectives:
        cure = "take survey=single, or an evaluation with objectives (performance, robust)"
        nothing = f"optimises an objective, but evaluation.type = {config.evaluation.type} has none"
        raise ConfigurationError(f"{place}: {nothing}; {cure}")
    _refuse_several_laws(config, place)


def _refuse_several_laws(config: RunConfig, place: str) -> None:
    if getattr(config.evaluation, "laws", None):
        cure = f"survey one with evaluation={config.evaluation.type}, whose law is the controller"
        raise ConfigurationError(f"{place}: several laws have their own values (evaluation.laws); {cure}")


def build_checked(config: RunConfig) -> tuple[Evaluation, Survey]:
    """Return evaluation and survey of a run that can be computed.

    Raises:
        ConfigurationError: the solver does not take such a loop.
    """
    _check_kinds(config)
    _check_measures(config)
    evaluation = build_evaluation(config)
    _check_loops(config, evaluation)
    return evaluation, build_survey(config, evaluation)


def _check_loops(config: RunConfig, evaluation: Evaluation) -> None:
    """The loop of the controller, or of each of several laws, can be built and is one for the solver."""
    given = config.evaluation
    laws = list(given.laws) if isinstance(given, MemoryOptions | FlightOptions) else []
    for number, name in enumerate(laws or [""]):
        try:
            refused = evaluation.solver.supports(evaluation.loop({LAW_NUMBER: float(number)} if laws else {}))
        except ArgumentError as error:
            place = f"evaluation.laws.{name}.values" if laws else "controller"
            cure = f"; {error.instead}" if error.instead else ""
            raise ConfigurationError(f"{place}.{error.name} = {error.value}: {error.allowed}{cure}") from error
        if refused is not None:
            place = f"evaluation.laws.{name}.type" if laws else f"solver.type = {config.solver.type}"
            raise ConfigurationError(f"{place}: {refused}")


def _check_kinds(config: RunConfig) -> None:
    """Delayed feedback and laws with a memory in the loop have evaluations and solvers of their own."""
    kind, solver = config.evaluation.type, config.solver.type
    for evaluation, own in _OWN_SOLVERS.items():
        if (kind == evaluation) != (solver == own):
            cure = f"evaluation={evaluation} and solver={own} go together"
            raise ConfigurationError(f"evaluation.type = {kind}: does not go with solver.type = {solver}; {cure}")
    if isinstance(config.evaluation, DelayedOptions) and config.evaluation.delay_from != "given":
        _check_no_delay_is_given(config, config.evaluation.delay_from)


def _check_measures(config: RunConfig) -> None:
    """Every kind of trajectories has measures of its own; loops are measured, and limited, in one place."""
    wanted = _TRAJECTORIES.get(config.evaluation.type, "Trajectory")
    for name in config.measures:
        taken = trajectories_of(registry.load("measures", name))
        if taken not in (wanted, None):
            meant = f"is made for trajectories of {TRAJECTORIES[str(taken)]}, not of {TRAJECTORIES[wanted]}"
            raise ConfigurationError(f"measures.{name}: {meant}; choose others ('fracctl list measures')")
    kind = config.evaluation.type
    for name in config.measures if kind not in _OF_LOOPS else ():
        if hasattr(registry.load("measures", name), "of_loop"):
            raise ConfigurationError(f"measures.{name}: needs evaluation=performance, but evaluation.type = {kind}")
    if config.constraints and kind not in _OF_LOOPS:
        raise ConfigurationError(f"constraints: need evaluation=performance, but evaluation.type = {kind}")
    _check_controls(config)


def _check_controls(config: RunConfig) -> None:
    """Some measures of loops are for few controls only."""
    controls = build_plant(config).n_controls
    for name in config.measures:
        most = getattr(registry.load("measures", name), "most_controls", controls)
        if controls > most:
            found = f"is made for {most} control, but {config.plant.type} has {controls}"
            raise ConfigurationError(f"measures.{name}: {found}; take sensitivity, which has the disk margin")


def _check_no_delay_is_given(config: RunConfig, source: str) -> None:
    """A delay that something else decides must not be set or varied: nobody would see that it plays no part."""
    law = registry.load("controllers", config.controller.type)
    default = next((p.default for p in law.parameters(build_plant(config).components) if p.name == "delay"), None)
    given = build_parameters(config).get("delay")
    survey = config.survey.model_dump()
    words = []
    if given != default:
        words.append(f"controller.delay = {given:g}")
    if "delay" in survey.get("axes", {}):
        words.append("survey.axes.delay")
    if "delay" in survey.get("vary", ()):
        words.append("survey.vary = [delay]")
    if words:
        cure = "set evaluation.delay_from=given"
        raise ConfigurationError(f"{words[0]}: plays no part with evaluation.delay_from = {source}; {cure}")


def build_plant(config: RunConfig) -> LinearPlant:
    """Return the plant."""
    plant: LinearPlant = construct(registry.load("plants", config.plant.type), config.plant)
    return plant


def build_parameters(config: RunConfig) -> dict[str, float]:
    """Return the values of the law's parameters."""
    return {name: value for name, value in config.controller if name != "type"}


def build_initial_conditions(config: RunConfig, plant: LinearPlant) -> dict[str, Floats]:
    """Return the dimensionless initial states, (2m,), by name."""
    return {name: _state(options.model_dump(), plant) for name, options in config.initial_condition.items()}


def _state(given: Mapping[str, Any], plant: LinearPlant) -> Floats:
    whole = flight.whole_state(given, plant)
    return np.array([whole[name] for name in plant.state_names])
