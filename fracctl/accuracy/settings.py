"""A solver with its knob at one value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fracctl.solvers import Collocation, Contour, Solver, Volterra

_WIDE_VOLTERRA, _WIDE_COLLOCATION = 1e-3, 0.99
"""Tolerances so wide that the knob alone decides how a trajectory is solved."""


@dataclass(frozen=True)
class Setting:
    """A solver at one resolution."""

    solver: Solver
    resolution: float
    """N of volterra and collocation, the tolerance of contour."""


def settings(values: Mapping[str, Sequence[float]]) -> Iterator[Setting]:
    """Yield the settings of resolutions by name of the solver, in this order.

    Raises:
        ArgumentError: a resolution lies outside what the solver takes.
    """
    for name, resolutions in values.items():
        for resolution in resolutions:
            yield Setting(_solver(name, resolution), float(resolution))


def _solver(name: str, resolution: float) -> Solver:
    if name == Contour.name:
        return Contour(resolution)
    if name == Volterra.name:
        return Volterra(int(resolution), tolerance=_WIDE_VOLTERRA)
    return Collocation(int(resolution), tolerance=_WIDE_COLLOCATION)
