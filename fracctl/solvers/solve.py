"""One call from a loop to its trajectory."""

from __future__ import annotations

from numpy.typing import ArrayLike

from fracctl.errors import ArgumentError, UnsupportedError, suggestion
from fracctl.loop import ClosedLoop
from fracctl.solvers.base import Solver
from fracctl.solvers.contour import Contour
from fracctl.trajectory import Trajectory

_SOLVERS = {Contour.name: Contour}


def make_solver(name: str) -> Solver:
    """Return a solver with its default options.

    Raises:
        ArgumentError: there is no solver of this name.
    """
    if name not in _SOLVERS:
        raise ArgumentError("solver", repr(name), f"must be one of {sorted(_SOLVERS)}{suggestion(name, _SOLVERS)}")
    return _SOLVERS[name]()


def solve(
    loop: ClosedLoop,
    initial_state: ArrayLike,
    horizon: float,
    solver: str = "contour",
    tolerance: float = 1e-8,
) -> Trajectory:
    """Solve a closed loop.

    Args:
        loop: plant and law, of b members or a single one.
        initial_state: [ξ(0), ξ'(0)], (n,) or (b, n), dimensionless.
        horizon: last time, dimensionless.
        solver: name of the solver.
        tolerance: error relative to the peaks of positions and controls.

    Raises:
        ArgumentError: an argument is out of range, has a wrong shape, or names no solver.
        UnsupportedError: the solver does not take this loop.
    """
    if solver not in _SOLVERS:
        raise ArgumentError("solver", repr(solver), f"must be one of {sorted(_SOLVERS)}{suggestion(solver, _SOLVERS)}")
    chosen = _SOLVERS[solver](tolerance)
    if refusal := chosen.supports(loop):
        raise UnsupportedError(refusal)
    return chosen.solve(loop, initial_state, horizon)
