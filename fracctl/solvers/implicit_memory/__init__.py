"""Implicit steps for stiff plants under laws with a fractional memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.solvers.implicit_memory.solver import ImplicitMemory

__all__ = ["ImplicitMemory"]


__getattr__ = loaded_at_first_use(__name__, {"ImplicitMemory": "solver"})
