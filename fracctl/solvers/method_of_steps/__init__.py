"""The method of steps: plants in state form under delayed feedback, or free."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.solvers.method_of_steps.solver import MethodOfSteps

__all__ = ["MethodOfSteps"]


__getattr__ = loaded_at_first_use(__name__, {"MethodOfSteps": "solver"})
