"""Fractional Chebyshev collocation: the solution as one polynomial over the horizon, as the literature has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.solvers.collocation.solver import Collocation

__all__ = ["Collocation"]


__getattr__ = loaded_at_first_use(__name__, {"Collocation": "solver"})
