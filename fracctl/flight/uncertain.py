"""What may be uncertain of a flight: its start, the spacecraft, what it measures, and the leader's orbit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError

Size = tuple[float, float]
"""Distance and speed of a start, dimensionless."""
MASS, THRUST = "mass_kg", "thrust_factor"
NOISES = ("position_noise_m", "velocity_noise_m_s")
_OFFSET, _PERCENT = "offset_", "_percent"


def offset_names(plant: Any) -> list[str]:
    """Names of what is added to a start: metres and m/s, or per cent of its distance and of its speed."""
    m = plant.n_controls
    units = [*["_m"] * m, *["_m_s"] * m]
    in_units = [f"{_OFFSET}{state}{unit}" for state, unit in zip(plant.state_names, units, strict=True)]
    return [*in_units, *(f"{_OFFSET}{state}{_PERCENT}" for state in plant.state_names)]


def bias_names(plant: Any) -> list[str]:
    """Names of errors of the navigation that stay over a flight."""
    return [f"{what}_bias_{c}{unit}" for what, unit in (("position", "_m"), ("velocity", "_m_s")) for c in _axes(plant)]


def check(name: str, lowest: float) -> None:
    """Raise ArgumentError unless a mass, a thrust factor or a noise can be as low as this."""
    if name in (MASS, THRUST) and lowest <= 0.0:
        raise ArgumentError(name, f"{lowest:g}", "must be positive")
    if name in NOISES and lowest < 0.0:
        raise ArgumentError(name, f"{lowest:g}", "must not be negative")


def size_of(state: Floats) -> Size:
    """Return |ξ(0)| and |ξ'(0)| of a start (2m,)."""
    positions, rates = np.split(state, 2)
    return float(np.linalg.norm(positions)), float(np.linalg.norm(rates))


def starts(plant: Any, nominal: Floats, drawn: Mapping[str, Floats], size: Size | None = None) -> Floats:
    """Return the states (b, n) of b flights that begin about a nominal one (n,).

    Args:
        plant: with states [ξ, ξ'] and scales.
        nominal: x(0), dimensionless.
        drawn: numbers by the names of `offset_names`, (b,) each; others play no part.
        size: what per cents are of: distance and speed of the start in all its components, of which the plant may take
            but a part; those of `nominal` without.
    """
    m, scales = plant.n_controls, plant.scales
    sizes = np.repeat(size or size_of(nominal), m)
    units = np.repeat([1.0 / scales.length_m, 1.0 / scales.speed_m_s], m)
    states = np.repeat(nominal[None], len(next(iter(drawn.values()))), axis=0)
    names = offset_names(plant)
    for place, (in_units, in_percent) in enumerate(zip(names[: 2 * m], names[2 * m :], strict=True)):
        if in_units in drawn:
            states[:, place] += units[place] * drawn[in_units]
        if in_percent in drawn:
            states[:, place] += 0.01 * sizes[place] * drawn[in_percent]
    return states


def efficiency(mass_kg: float | None, drawn: Mapping[str, Floats]) -> Floats:
    """Return the acceleration that thrusters give over what is asked for, (b,): m₀/m times their thrust factor."""
    factor = np.array(drawn.get(THRUST, np.ones(1)))
    if MASS in drawn:
        assert mass_kg is not None
        factor = factor * mass_kg / drawn[MASS]
    return factor


def biases(plant: Any, drawn: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Return the biases of positions and velocities, dimensionless, (b, m) each."""
    b, m, names = len(next(iter(drawn.values()))), plant.n_controls, bias_names(plant)
    table = np.column_stack([drawn.get(name, np.zeros(b)) for name in names])
    return table[:, :m] / plant.scales.length_m, table[:, m:] / plant.scales.speed_m_s


def _axes(plant: Any) -> list[str]:
    return list(plant.components)
