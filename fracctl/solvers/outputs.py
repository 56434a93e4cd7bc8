"""Positions, rates and controls from derivatives of the coordinates, and how far two solutions differ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from fracctl.arrays import Floats
from fracctl.fractional.system import LinearFractionalSystem

SAFETY = 2.0
"""Estimate over the difference of two solutions: where neither is resolved, they may err to the same side."""
Derivative = Callable[[int, float], Floats]
"""D^order of a coordinate at 0 and at the nodes of a grid, (k, b, 1 + T)."""


@dataclass(frozen=True)
class Values:
    """Values of a group of members on a grid, from k initial states each."""

    positions: Floats
    """(k, b, m, T)."""
    rates: Floats | None
    """(k, b, m, T)."""
    auxiliary: Floats
    """(k, b, q, T)."""
    controls: Floats
    """(k, b, m, T)."""
    initial_controls: Floats
    """υ(0+), (k, b, m)."""
    error: Floats
    """Estimated error of positions and controls over their peaks, (k, b)."""


def values(system: LinearFractionalSystem, fine: Derivative, coarse: Derivative, with_rates: bool) -> Values:
    """Return the outputs of the `fine` solution, its error estimated by that of the `coarse` one."""
    m = system.n_positions
    fine, coarse = cache(fine), cache(coarse)
    coordinates, controls = _coordinates(system, fine), _controls(system, fine)
    rough, rough_controls = _coordinates(system, coarse), _controls(system, coarse)
    return Values(
        positions=coordinates[:, :, :m, 1:],
        rates=np.stack([fine(i, 1.0) for i in range(m)], axis=2)[..., 1:] if with_rates else None,
        auxiliary=coordinates[:, :, m:, 1:],
        controls=controls[..., 1:],
        initial_controls=controls[..., 0],
        error=SAFETY
        * np.maximum(_difference(coordinates[:, :, :m], rough[:, :, :m]), _difference(controls, rough_controls)),
    )


def _coordinates(system: LinearFractionalSystem, derivative: Derivative) -> Floats:
    return np.stack([derivative(i, 0.0) for i in range(system.size)], axis=2)


def _controls(system: LinearFractionalSystem, derivative: Derivative) -> Floats:
    """Return υ, (k, b, m, 1 + T)."""
    gains: dict[tuple[int, float], Floats] = {}
    for term in system.control:
        for column in np.flatnonzero(term.matrix.any(axis=tuple(range(term.matrix.ndim - 1)))):
            key = int(column), float(term.orders[column])
            gains[key] = gains.get(key, np.zeros(())) + term.matrix[..., column]
    first = derivative(0, 0.0)
    total = np.zeros((*first.shape[:2], system.n_positions, first.shape[2]))
    for (component, order), gain in gains.items():
        total += gain[..., None] * derivative(component, order)[:, :, None]
    return total


def _difference(fine: Floats, coarse: Floats) -> Floats:
    """Return the largest difference over the peak, (k, b): 0 where both vanish, +inf where one is no number."""
    difference, peak = np.abs(fine - coarse).max(axis=(-2, -1)), np.abs(fine).max(axis=(-2, -1))
    relative: Floats = np.divide(difference, peak, out=np.where(difference == 0.0, 0.0, np.inf), where=peak > 0.0)
    return np.where(np.isnan(relative), np.inf, relative)
