"""Solvers: each says what it can solve and refuses the rest with the solver to use instead.

Their classes are loaded at first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use
from fracctl.solvers.base import SolvedMembers, Solver
from fracctl.solvers.solve import solve

if TYPE_CHECKING:
    from fracctl.solvers.collocation.solver import Collocation
    from fracctl.solvers.contour.solver import Contour
    from fracctl.solvers.explicit_memory.solver import ExplicitMemory
    from fracctl.solvers.implicit_memory.solver import ImplicitMemory
    from fracctl.solvers.method_of_steps.solver import MethodOfSteps
    from fracctl.solvers.volterra.solver import Volterra

__all__ = [
    "Collocation",
    "Contour",
    "ExplicitMemory",
    "ImplicitMemory",
    "MethodOfSteps",
    "SolvedMembers",
    "Solver",
    "Volterra",
    "solve",
]


__getattr__ = loaded_at_first_use(
    __name__,
    {
        "Collocation": "collocation",
        "Contour": "contour",
        "ExplicitMemory": "explicit_memory",
        "ImplicitMemory": "implicit_memory",
        "MethodOfSteps": "method_of_steps",
        "Volterra": "volterra",
    },
)
