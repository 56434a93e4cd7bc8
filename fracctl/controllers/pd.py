"""Proportional-derivative control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from numpy.typing import ArrayLike

from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd_alpha import PDAlpha


class PD(PDAlpha):
    """PD control, PD^α at α = 1.

        υ = -K_P ξ - K_D ξ'        (Yaylali, Butcher, Sinclair, Eqs. 6-7)

    Args:
        k_p: K_P; () or (b,) for one control, (m, m) or (b, m, m) otherwise; 1/time².
        k_d: K_D, shaped as `k_p`; 1/time.

    Raises:
        ArgumentError: a gain is not finite, or a shape is wrong.
    """

    def __init__(self, k_p: ArrayLike, k_d: ArrayLike) -> None:
        super().__init__(k_p, k_d, 1.0)

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return k_p_…, k_d_… for the given components, in the order of the tables' columns."""
        return tuple(p for p in PDAlpha.parameters(components) if not p.name.startswith("alpha_"))

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> PD:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        names = [parameter.name for parameter in cls.parameters(components)]
        law = PDAlpha.from_parameters(components, {name: values[name] for name in names if name in values})
        return cls(law.k_p, law.k_d)
