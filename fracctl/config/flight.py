"""What an engineer gives in units: the simulated time, the bound of the thrusters, starts by orbit elements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fracctl.arrays import Floats
from fracctl.config import registry
from fracctl.config.evaluations import (
    DelayedEvaluation,
    FlightEvaluation,
    MemoryEvaluation,
    PerformanceEvaluation,
    RobustEvaluation,
)
from fracctl.config.options import construct
from fracctl.config.parts import DIFFERENCES, state_keys
from fracctl.config.schemas import HORIZONS, RunConfig
from fracctl.controllers import Saturation
from fracctl.dispersions import Distribution
from fracctl.elements import linearised_map, relative_state
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.flight.uncertain import Size, size_of
from fracctl.plants.capabilities import ChiefPlant, TurningPlant
from fracctl.units import Scales, Spacecraft

if TYPE_CHECKING:
    from fracctl.flight import Surroundings

_SECONDS = {"horizon_min": 60.0, "horizon_s": 1.0}


def horizon(config: RunConfig, scales: Scales | None) -> float:
    """Return the simulated time, dimensionless.

    Raises:
        ConfigurationError: it is given in a unit of time, and the plant has none.
    """
    (name,) = [name for name in HORIZONS if getattr(config, name) is not None]
    value = float(getattr(config, name))
    if name == "horizon_periods":
        return 2.0 * math.pi * value
    return value * _SECONDS[name] / _scales(scales, f"{name} = {value:g}", "horizon_periods").time_s


def spacecraft(config: RunConfig) -> Spacecraft:
    """Return what flies."""
    return Spacecraft(**config.spacecraft.model_dump())


def saturation(config: RunConfig, scales: Scales | None) -> Saturation | None:
    """Return what the thrusters can give, None for any.

    Raises:
        ConfigurationError: there are two bounds, one in SI units for a plant without, a thrust without a mass, or one
            that the evaluation does not take.
    """
    evaluation, craft = config.evaluation, config.spacecraft
    bounds = {
        "evaluation.largest_control": getattr(evaluation, "largest_control", None),
        "evaluation.largest_acceleration_mm_s2": getattr(evaluation, "largest_acceleration_mm_s2", None),
        "spacecraft.thrust_n": craft.thrust_n,
    }
    given = {name: value for name, value in bounds.items() if value is not None}
    if not given:
        return None
    (name, value), *others = given.items()
    if others:
        raise ConfigurationError(f"{others[0][0]} = {others[0][1]:g}: a second bound beside {name}; keep one of them")
    if not isinstance(evaluation, PerformanceEvaluation | DelayedEvaluation | FlightEvaluation):
        raise ConfigurationError(f"{name} = {value:g}: plays no part with evaluation.type = {evaluation.type}")
    if name == "spacecraft.thrust_n":
        if craft.mass_kg is None:
            raise ConfigurationError(f"{name} = {value:g}: needs a mass; set spacecraft.mass_kg")
        value /= craft.mass_kg
    elif name.endswith("mm_s2"):
        value *= 1e-3
    if name != "evaluation.largest_control":
        value /= _scales(scales, f"{name} = {given[name]:g}", "evaluation.largest_control").acceleration_m_s2
    return Saturation(value, evaluation.largest_by)


def surroundings(config: RunConfig, given: FlightEvaluation, plant: Any) -> Surroundings:
    """Return what flights of a plant with units meet.

    Raises:
        ConfigurationError: an impulse bit comes without a mass.
        ArgumentError: a dispersion or the true plant does not fit.
    """
    from fracctl.flight import Surroundings  # loads the sampled laws
    from fracctl.sampled import Actuator, Navigation

    scales, craft, thrusters = plant.scales, spacecraft(config), given.thrusters
    if scales is None:
        raise ArgumentError(
            "plant", type(plant).__name__, "must have units for flights", "set plant.scales, or take plant=hcw"
        )
    if thrusters.impulse_bit_n_s and craft.mass_kg is None:
        where = f"evaluation.thrusters.impulse_bit_n_s = {thrusters.impulse_bit_n_s:g}"
        raise ConfigurationError(f"{where}: needs a mass; set spacecraft.mass_kg")
    navigation = given.navigation
    actuator = Actuator(
        saturation(config, scales),
        1e-3 * thrusters.deadband_mm_s2 / scales.acceleration_m_s2,
        thrusters.impulse_bit_n_s / (craft.mass_kg or 1.0) / scales.speed_m_s,
    )
    try:
        actuator.check(plant.n_controls, given.period_s / scales.time_s)
    except ArgumentError as error:
        where = f"evaluation.thrusters.impulse_bit_n_s = {thrusters.impulse_bit_n_s:g}"
        cure = "take a smaller bit, more thrust, or a longer period_s"
        raise ConfigurationError(f"{where}: is more than the thrusters give in a period; {cure}") from error
    return Surroundings(
        plant,
        None if given.truth is None else _truth(given, plant),
        actuator,
        Navigation(
            navigation.position_noise_m / scales.length_m,
            navigation.velocity_noise_m_s / scales.speed_m_s,
            navigation.position_bias_m / scales.length_m,
            navigation.velocity_bias_m_s / scales.speed_m_s,
            navigation.every,
        ),
        craft,
        distributions(given),
        config.seed,
    )


def distributions(given: FlightEvaluation | MemoryEvaluation | RobustEvaluation) -> dict[str, Distribution]:
    """Return what is uncertain, by name."""
    return {name: Distribution.of(numbers) for name, numbers in given.dispersions.items() if numbers is not None}


def _truth(given: FlightEvaluation, plant: Any) -> Any:
    assert given.truth is not None
    if not isinstance(plant, ChiefPlant):
        cure = "take plant=hcw, or leave truth null"
        raise ConfigurationError(f"evaluation.truth.type = {given.truth.type}: needs a chief on an orbit; {cure}")
    return construct(registry.load("plants", given.truth.type), given.truth, leader=plant.chief)


def in_units(name: str, measure: Any, plant: Any, craft: Spacecraft) -> Any:
    """Return a measure that knows the plant's units and the spacecraft, where it needs them.

    Raises:
        ConfigurationError: it needs what they lack.
    """
    if not hasattr(measure, "for_flight"):
        return measure
    try:
        return measure.for_flight(plant, craft)
    except ArgumentError as error:
        raise ConfigurationError(f"measures.{name}: {error.name} {error.allowed}") from error


def start_sizes(config: RunConfig, plant: Any) -> dict[str, Size]:
    """Return distance and speed of every start as it is configured, whatever the plant takes of it."""
    starts = {name: whole_state(options.model_dump(), plant) for name, options in config.initial_condition.items()}
    return {name: size_of(np.array(list(whole.values()))) for name, whole in starts.items()}


def whole_state(given: Mapping[str, Any], plant: Any) -> dict[str, float]:
    """Return the dimensionless state of a start by name, in all three components for a part of HCW."""
    names = state_keys(plant)
    if given["units"] == "elements":
        return dict(zip(names, state_of_differences(given, plant).tolist(), strict=True))
    state = np.array([given[name] for name in names], dtype=np.float64)
    if given["units"] == "si" and plant.scales is not None:
        state /= np.repeat([plant.scales.length_m, plant.scales.speed_m_s], len(names) // 2)
    return dict(zip(names, state.tolist(), strict=True))


def state_of_differences(given: Mapping[str, Any], plant: Any) -> Floats:
    """Return the dimensionless state that differences of orbit elements from the plant's chief are, (6,)."""
    degrees = math.pi / 180.0
    units = [1e3 / plant.scales.length_m, degrees, degrees, 1.0, 1.0, degrees]
    differences = np.array([given[name] for name in DIFFERENCES]) * units
    chief = plant.chief_elements
    if given["linearised"]:
        linear: Floats = linearised_map(chief) @ differences
        return linear
    return relative_state(chief, differences, plant.frame_rate if isinstance(plant, TurningPlant) else None)


def _scales(scales: Scales | None, what: str, instead: str) -> Scales:
    if scales is None:
        raise ConfigurationError(f"{what}: needs a plant with units; give {instead} instead")
    return scales
