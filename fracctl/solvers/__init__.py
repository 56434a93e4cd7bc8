"""Solvers: each says what it can solve and refuses the rest with the solver to use instead."""

from fracctl.solvers.base import Solver, Survey
from fracctl.solvers.contour import Contour
from fracctl.solvers.solve import solve

__all__ = ["Contour", "Solver", "Survey", "solve"]
