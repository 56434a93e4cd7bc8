"""Solvers: each says what it can solve and refuses the rest with the solver to use instead.

Their classes are loaded at first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fracctl.solvers.base import Solver, Survey
from fracctl.solvers.solve import solve

if TYPE_CHECKING:
    from fracctl.solvers.collocation import Collocation
    from fracctl.solvers.contour import Contour
    from fracctl.solvers.explicit_memory import ExplicitMemory
    from fracctl.solvers.implicit_memory import ImplicitMemory
    from fracctl.solvers.method_of_steps import MethodOfSteps
    from fracctl.solvers.volterra import Volterra

__all__ = [
    "Collocation",
    "Contour",
    "ExplicitMemory",
    "ImplicitMemory",
    "MethodOfSteps",
    "Solver",
    "Survey",
    "Volterra",
    "solve",
]


def __getattr__(name: str) -> Any:
    if name in __all__:
        module = "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
        return getattr(import_module(f"fracctl.solvers.{module}"), name)
    raise AttributeError(f"module 'fracctl.solvers' has no attribute '{name}'")
