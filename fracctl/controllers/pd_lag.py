"""Proportional-derivative control with a lag in the derivative."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pid import PID


class PDLag(PID):
    """PD control whose derivative passes a lag of first order: PID without the integral.

        υ = -K_P ξ - K_D z,        T_f z' = ξ' - z,        z(0) = 0

    For one component υ = -(k_P + k_D s/(T_f s + 1)) w is a lead-lag compensator, with as many parameters as PD^α.

    Args:
        k_p: K_P; () or (b,) for one control, (m, m) or (b, m, m) otherwise; 1/time².
        k_d: K_D, shaped as `k_p`; 1/time.
        time_constant: T_f > 0; () or (m,), and for a batch (b,) for one control or (b, m) otherwise; time.

    Raises:
        ArgumentError: a gain is not finite, a time constant is not positive, or a shape is wrong.
    """

    def __init__(self, k_p: ArrayLike, k_d: ArrayLike, time_constant: ArrayLike) -> None:
        super().__init__(k_p, np.zeros(np.shape(k_p)), k_d, time_constant)

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return time_constant_…, k_p_…, k_d_… for the given components, in the order of the tables' columns."""
        return tuple(p for p in PID.parameters(components) if not p.name.startswith("k_i_"))

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> PDLag:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        names = [parameter.name for parameter in cls.parameters(components)]
        law = PID.from_parameters(components, {name: values[name] for name in names if name in values})
        return cls(law.k_p, law.k_d, law.time_constant)
