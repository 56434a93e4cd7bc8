"""Solvers: each says what it can solve and refuses the rest with the solver to use instead."""

from fracctl.solvers.base import Solver, Survey
from fracctl.solvers.collocation import Collocation
from fracctl.solvers.contour import Contour
from fracctl.solvers.solve import solve
from fracctl.solvers.volterra import Volterra

__all__ = ["Collocation", "Contour", "Solver", "Survey", "Volterra", "solve"]
