"""One call from a loop to its trajectory."""

from __future__ import annotations

from importlib import import_module

from numpy.typing import ArrayLike

from fracctl.errors import ArgumentError, suggestion
from fracctl.loop import ClosedLoop
from fracctl.solvers.batched import BatchSolver
from fracctl.trajectory import Trajectory

_SOLVERS = {"contour": "Contour", "volterra": "Volterra", "collocation": "Collocation"}
"""Class in the module of the name, which is loaded at first use."""


def make_solver(name: str, tolerance: float | None = None) -> BatchSolver:
    """Return a solver with its default options, or with a tolerance.

    Raises:
        ArgumentError: there is no solver of this name, or the tolerance lies outside its range.
    """
    if name not in _SOLVERS:
        raise ArgumentError("solver", repr(name), f"must be one of {sorted(_SOLVERS)}{suggestion(name, _SOLVERS)}")
    kind: type[BatchSolver] = getattr(import_module(f"fracctl.solvers.{name}"), _SOLVERS[name])
    return kind() if tolerance is None else kind(tolerance=tolerance)  # type: ignore[call-arg]


def solve(
    loop: ClosedLoop,
    initial_state: ArrayLike,
    horizon: float,
    solver: str = "contour",
    tolerance: float | None = None,
) -> Trajectory:
    """Solve a closed loop.

    Args:
        loop: plant and law, of b members or a single one.
        initial_state: [ξ(0), ξ'(0)], (n,) or (b, n), dimensionless.
        horizon: last time, dimensionless.
        solver: ``contour``, ``volterra`` or ``collocation``.
        tolerance: error relative to the peaks of positions and controls above which a trajectory is ``failed``; None
            for the solver's own, 1e-8 (1e-2 for ``collocation``, which is not made for more).

    Raises:
        ArgumentError: an argument is out of range, has a wrong shape, or names no solver.
        UnsupportedError: the solver does not take this loop.
    """
    return make_solver(solver, tolerance).solve(loop, initial_state, horizon)
