"""One call from a loop to its trajectory."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Literal, overload

from numpy.typing import ArrayLike

from fracctl.errors import ArgumentError, suggestion
from fracctl.loop import ClosedLoop
from fracctl.solvers.batched import BatchSolver
from fracctl.trajectory import Trajectory

if TYPE_CHECKING:
    from fracctl.meshwise import MeshTrajectory
    from fracctl.solvers.explicit_memory.solver import ExplicitMemory
    from fracctl.stepwise import StepwiseTrajectory

_SOLVERS = {
    "contour": "Contour",
    "volterra": "Volterra",
    "collocation": "Collocation",
    "explicit_memory": "ExplicitMemory",
}
"""Class in the module of the name, which is loaded at first use."""


def make_solver(name: str, tolerance: float | None = None) -> BatchSolver | ExplicitMemory:
    """Return a solver with its default options, or with a tolerance.

    Raises:
        ArgumentError: there is no solver of this name, or the tolerance lies outside its range.
    """
    if name not in _SOLVERS:
        raise ArgumentError("solver", repr(name), f"must be one of {sorted(_SOLVERS)}{suggestion(name, _SOLVERS)}")
    kind: type[BatchSolver | ExplicitMemory] = getattr(import_module(f"fracctl.solvers.{name}"), _SOLVERS[name])
    return kind() if tolerance is None else kind(tolerance=tolerance)  # type: ignore[call-arg]


@overload
def solve(
    loop: ClosedLoop,
    initial_state: ArrayLike,
    horizon: float,
    solver: Literal["contour", "volterra", "collocation", "explicit_memory"] = ...,
    tolerance: float | None = ...,
) -> Trajectory: ...


@overload
def solve(
    loop: ClosedLoop,
    initial_state: ArrayLike,
    horizon: float,
    solver: Literal["method_of_steps"],
    tolerance: float | None = ...,
) -> StepwiseTrajectory: ...


@overload
def solve(
    loop: ClosedLoop,
    initial_state: ArrayLike,
    horizon: float,
    solver: Literal["implicit_memory"],
    tolerance: float | None = ...,
) -> MeshTrajectory: ...


@overload
def solve(
    loop: ClosedLoop, initial_state: ArrayLike, horizon: float, solver: str, tolerance: float | None = ...
) -> Trajectory | StepwiseTrajectory | MeshTrajectory: ...


def solve(
    loop: ClosedLoop,
    initial_state: ArrayLike,
    horizon: float,
    solver: str = "contour",
    tolerance: float | None = None,
) -> Trajectory | StepwiseTrajectory | MeshTrajectory:
    """Solve a closed loop.

    Args:
        loop: plant and law, of b members or a single one.
        initial_state: [ξ(0), ξ'(0)], or x(0) of a plant in state form, (n,) or (b, n), dimensionless.
        horizon: last time, dimensionless.
        solver: ``contour``, ``volterra`` or ``collocation`` for linear fractional loops, ``explicit_memory`` for the
            same laws on nonlinear plants and with saturation, ``method_of_steps`` for delayed feedback and free
            motion, nonlinear plants included; ``implicit_memory`` for nonlinear laws with a memory in the loop on
            stiff plants, as of a tether.
        tolerance: error relative to the peaks of positions and controls above which a trajectory is ``failed``; None
            for the solver's own, 1e-8 (1e-2 for ``collocation``, which is not made for more; any for
            ``method_of_steps`` and ``implicit_memory``, which tell their errors in `error_estimate`).

    Raises:
        ArgumentError: an argument is out of range, has a wrong shape, or names no solver.
        UnsupportedError: the solver does not take this loop.
    """
    if solver == "method_of_steps":
        from fracctl.solvers.method_of_steps.solver import MethodOfSteps

        return MethodOfSteps(tolerance=tolerance or 0.0).solve(loop, initial_state, horizon)
    if solver == "implicit_memory":
        from fracctl.solvers.implicit_memory.solver import ImplicitMemory

        return ImplicitMemory(tolerance=tolerance or 0.0).solve(loop, initial_state, horizon)
    if solver not in _SOLVERS:
        known = sorted([*_SOLVERS, "implicit_memory", "method_of_steps"])
        raise ArgumentError("solver", repr(solver), f"must be one of {known}{suggestion(str(solver), known)}")
    return make_solver(solver, tolerance).solve(loop, initial_state, horizon)
