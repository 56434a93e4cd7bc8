"""Nonlinear and saturated loops under laws with fractional memory: collocation on steps, the past in exponentials."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.solvers.explicit_memory.solver import ExplicitMemory

__all__ = ["ExplicitMemory"]


__getattr__ = loaded_at_first_use(__name__, {"ExplicitMemory": "solver"})
