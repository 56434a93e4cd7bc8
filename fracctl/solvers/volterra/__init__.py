"""Volterra collocation: the highest derivatives as unknowns, with the leading powers of time taken out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.solvers.volterra.solver import Volterra

__all__ = ["Volterra"]


__getattr__ = loaded_at_first_use(__name__, {"Volterra": "solver"})
