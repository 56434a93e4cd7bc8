"""The contour solver: numerical inversion of the Laplace transform for whole batches of loops, with a certificate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.solvers.contour.solver import Contour

__all__ = ["Contour"]


__getattr__ = loaded_at_first_use(__name__, {"Contour": "solver"})
