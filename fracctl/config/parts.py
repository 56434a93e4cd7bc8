"""The parts of a run whose keys depend on other parts: on the type, the plant's states, the law's parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, create_model
from pydantic_core import InitErrorDetails, PydanticCustomError

from fracctl.config import registry
from fracctl.config.fields import Number, Strict, Typed, each, refusal, refuse, unknown
from fracctl.config.options import construct, factory_of, named_factory, options_of, typed_options_of
from fracctl.controllers import Parameter
from fracctl.errors import ArgumentError
from fracctl.plants import LinearPlant
from fracctl.plants.capabilities import OrbitalPlant
from fracctl.surveys import axis_values

LARGEST_GRID = 100_000_000
"""More points than this are taken for a mistyped step."""

DIFFERENCES = (
    "delta_a_km",
    "delta_argument_of_latitude_deg",
    "delta_inclination_deg",
    "delta_q_1",
    "delta_q_2",
    "delta_raan_deg",
)
"""Keys of a start by orbit elements, in the order of `fracctl.elements`."""

_HCW_STATES = ("u", "v", "w", "u_dot", "v_dot", "w_dot")


def registered(value: Any, info: ValidationInfo) -> Typed:
    """A plant or a solver."""
    factory = factory_of(f"{info.field_name}s", plain(value))
    options = typed_options_of(factory).model_validate(plain(value))
    construct(factory, options)
    return options


def controller(value: Any, info: ValidationInfo) -> Typed:
    """A law: its parameters for the components of the plant; unchecked while the plant is wrong."""
    value = plain(value)
    law = factory_of("controllers", value)
    plant = plant_of(info.data)
    if plant is None:
        return Typed(type=value["type"])
    return law_schema(law, plant.components).model_validate(value)


@cache
def law_schema(law: Any, components: tuple[str, ...]) -> type[Typed]:
    """The schema of a law's parameters."""
    fields: dict[str, Any] = {}
    for parameter in law.parameters(components):
        fields[parameter.name] = (Annotated[Number, AfterValidator(_within(parameter))], parameter.default)
    return create_model(f"{law.__name__}Parameters", __base__=Typed, **fields)


def initial_condition(value: Any, info: ValidationInfo) -> Strict:
    """One initial condition of the plant; unchecked while the plant is wrong."""
    plant = plant_of(info.data)
    if plant is None:
        return Strict()
    by_elements = isinstance(plain(value), Mapping) and plain(value).get("units") == "elements"
    schema = differences_schema() if by_elements else states_schema(state_keys(plant))
    options = schema.model_validate(plain(value))
    given = options.model_dump()
    if by_elements:
        return _checked_differences(options, given, plant)
    if given["units"] == "si" and plant.scales is None:
        cure = "set plant.scales, or give" if type(plant) is LinearPlant else f"{type(plant).__name__} has none; give"
        raise refuse(refusal(("units",), "si", f"needs a plant with scales; {cure} dimensionless values"))
    if not any(given[name] for name in plant.state_names):
        states = ", ".join(plant.state_names)
        still = f"nothing moves, for all states of the plant are 0; set one of {states}"
        raise refuse(refusal((), given, still, "sentence"))
    return options


def _checked_differences(options: Strict, given: Mapping[str, Any], plant: Any) -> Strict:
    if not isinstance(plant, OrbitalPlant):
        raise refuse(refusal(("units",), "elements", "needs a plant with a chief on an orbit; give its states"))
    if not any(given[name] for name in DIFFERENCES):
        still = f"nothing moves, for all differences are 0; set one of {', '.join(DIFFERENCES)}"
        raise refuse(refusal((), given, still, "sentence"))
    return options


@cache
def differences_schema() -> type[Strict]:
    """The schema of a start by orbit elements; differences that are not given are 0."""
    fields: dict[str, Any] = {"units": (Literal["elements"], "elements")}
    fields |= dict.fromkeys(DIFFERENCES, (Number, 0.0))
    fields["linearised"] = (Annotated[bool, Field(strict=True)], False)
    return create_model("ElementDifferences", __base__=Strict, **fields)


@cache
def states_schema(names: tuple[str, ...]) -> type[Strict]:
    """The schema of an initial condition; states that are not given are 0."""
    fields: dict[str, Any] = {"units": (Literal["dimensionless", "si", "elements"], "dimensionless")}
    fields |= dict.fromkeys(names, (Number, 0.0))
    return create_model("InitialCondition", __base__=Strict, **fields)


def state_keys(plant: LinearPlant) -> tuple[str, ...]:
    """Keys of an initial condition: the plant's states, or all six for a part of HCW."""
    return _HCW_STATES if set(plant.components) <= set("uvw") else plant.state_names


def measures(value: Any) -> dict[str, Strict]:
    """Options of measures by their names."""
    if not isinstance(value, Mapping) or not value:
        raise refuse(refusal((), value, "must be a mapping of measures to their options"))

    def measure(name: str, entry: Any) -> Strict:
        if name not in registry.names("measures"):
            raise refuse(unknown((), entry, registry.names("measures")))
        factory = named_factory("measures", name)
        options = options_of(factory).model_validate({} if entry is None else plain(entry))
        construct(factory, options)
        return options

    return each(value, measure)


def survey(value: Any, info: ValidationInfo, built_in: Mapping[str, type[Typed]]) -> Typed:
    """A survey; the axes of a grid are checked against the law's parameters."""
    value = plain(value)
    factory = factory_of("surveys", value)
    own = value["type"] not in built_in
    schema = typed_options_of(factory, omitted=("evaluation", "seed")) if own else built_in[value["type"]]
    if _LIMITS in value and _LIMITS not in schema.model_fields:
        raise refuse(refusal((_LIMITS,), value[_LIMITS], _LIMITS_OF_THE_RUN, "sentence"))
    options = schema.model_validate(value)
    if own:
        return options
    parameters = parameters_of(info.data)
    if value["type"] == "grid":
        lines = _grid_lines(options.model_dump(), parameters)
        if lines:
            raise refuse(*lines)
    return options


def setting_lines(resolutions: Mapping[str, Sequence[float]]) -> list[InitErrorDetails]:
    """Errors of resolutions by solver that the solvers do not take."""
    from fracctl.accuracy import settings  # loads all solvers

    lines = [] if any(resolutions.values()) else [refusal((), resolutions, "must hold at least one resolution")]
    for name, values in resolutions.items():
        try:
            list(settings({name: values}))
        except ArgumentError as error:
            lines.append(refusal((name,), list(values), f"{error.allowed}, but holds {error.value}"))
    return lines


_LIMITS = "constraints"
_LIMITS_OF_THE_RUN = "limits belong to the run, not to its survey; set 'constraints.COLUMN=\"<= NUMBER\"'"


def plant_of(data: Mapping[str, Any]) -> LinearPlant | None:
    """The plant of the fields validated so far, None if it is wrong."""
    options = data.get("plant")
    if options is None:
        return None
    plant: LinearPlant = construct(registry.load("plants", options.type), options)
    return plant


def parameters_of(data: Mapping[str, Any]) -> dict[str, Parameter] | None:
    """The law's parameters by name, None if the plant or the controller is wrong."""
    plant = plant_of(data)
    options = data.get("controller")
    if plant is None or options is None:
        return None
    law = registry.load("controllers", options.type)
    return {parameter.name: parameter for parameter in law.parameters(plant.components)}


def measure_columns(options: Mapping[str, Strict]) -> list[str]:
    """The columns that the measures fill."""
    made = (construct(registry.load("measures", name), entry) for name, entry in options.items())
    return [column for measure in made for column in measure.columns]


def plain(value: Any) -> Any:
    """A model as plain data; everything else as it is."""
    return value.model_dump() if isinstance(value, Strict) else value


def _within(parameter: Parameter) -> Callable[[float], float]:
    def check(value: float) -> float:
        if not parameter.contains(value):
            raise PydanticCustomError("refused", parameter.allowed)
        return value

    return check


def _grid_lines(options: Mapping[str, Any], parameters: Mapping[str, Parameter] | None) -> list[InitErrorDetails]:
    axes, lines, sizes = options["axes"], [], []
    if not axes:
        lines.append(refusal(("axes",), axes, "must hold at least one axis"))
    for name, spec in axes.items():
        if parameters is not None and name not in parameters:
            lines.append(unknown(("axes", name), spec, parameters))
            continue
        try:
            values = axis_values(spec, name)
        except ArgumentError as error:
            cure = f"; {error.instead}" if error.instead else ""
            lines.append(refusal(("axes", name), spec, f"{error.allowed}{cure}"))
            continue
        sizes.append(len(values))
        lines += _outside(name, spec, values.tolist(), parameters)
    if math.prod(sizes) > LARGEST_GRID:
        lines.append(refusal(("axes",), axes, f"{math.prod(sizes)} points; at most {LARGEST_GRID}", "sentence"))
    return lines + _references(options, [name for name in axes if parameters is None or name in parameters])


def _outside(
    name: str, spec: Any, values: Sequence[float], parameters: Mapping[str, Parameter] | None
) -> list[InitErrorDetails]:
    outside = [value for value in values if parameters and not parameters[name].contains(value)]
    if not parameters or not outside:
        return []
    but = "" if isinstance(spec, int | float) else f", but holds {outside[0]:g}"
    return [refusal(("axes", name), spec, f"{parameters[name].allowed}{but}")]


def _references(options: Mapping[str, Any], axes: Sequence[str]) -> list[InitErrorDetails]:
    """Errors of `slice` and `baseline`, which name axes."""
    baseline, slice_ = options["baseline"], options["slice"]
    lines = [unknown(("baseline", name), value, axes) for name, value in baseline.items() if name not in axes]
    if slice_ is not None and slice_ not in axes:
        lines.append(refusal(("slice",), slice_, f"must be null or one of the axes ({', '.join(axes)})"))
    return lines
