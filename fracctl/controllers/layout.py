"""Scalar parameters by name, and the gain matrices and vectors over the components that they fill."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite
from fracctl.controllers.parameters import Parameter, entry_names
from fracctl.errors import ArgumentError


def gain_parameters(prefix: str, components: Sequence[str]) -> list[Parameter]:
    """Return the entries of a gain matrix, row by row: ``k_p_u``, ``k_p_uv``, ``k_p_vu``, ``k_p_v``."""
    return [Parameter(name) for row in entry_names(prefix, components) for name in row]


def order_parameters(prefix: str, components: Sequence[str]) -> list[Parameter]:
    """Return one order in (0, 1] for each component: ``alpha_u``, ``alpha_v``."""
    return [
        Parameter(f"{prefix}_{c}", default=1.0, lower=0.0, upper=1.0, lower_allowed=False, kind="order")
        for c in components
    ]


def filled(parameters: Iterable[Parameter], values: Mapping[str, ArrayLike]) -> dict[str, Floats]:
    """Return numbers or arrays (b,) for all parameters by name; missing ones take their defaults."""
    return {p.name: finite(p.name, values.get(p.name, p.default)) for p in parameters}


def gain_matrix(table: Mapping[str, Floats], prefix: str, components: Sequence[str]) -> Floats:
    """Return the gain matrix of a prefix, (m, m) or (b, m, m)."""
    names = entry_names(prefix, components)
    flat = np.broadcast_arrays(*[table[name] for row in names for name in row])
    return np.stack(flat, axis=-1).reshape(*flat[0].shape, len(components), len(components))


def component_vector(table: Mapping[str, Floats], prefix: str, components: Sequence[str]) -> Floats:
    """Return one number a component, (m,) or (b, m)."""
    return np.stack(np.broadcast_arrays(*[table[f"{prefix}_{c}"] for c in components]), axis=-1)


def in_range(parameters: Sequence[Parameter], given: Mapping[str, ArrayLike]) -> dict[str, Floats]:
    """Return numbers or arrays (b,) by parameter name.

    Raises:
        ArgumentError: one lies outside its range.
    """
    values = {parameter.name: finite(parameter.name, given[parameter.name]) for parameter in parameters}
    for parameter in parameters:
        for value in values[parameter.name].ravel():
            if not parameter.contains(float(value)):
                raise ArgumentError(parameter.name, float(value), parameter.allowed)
    return values
