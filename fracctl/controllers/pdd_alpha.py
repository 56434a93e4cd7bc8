"""Proportional control with a derivative of integer and one of fractional order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import finite, matrices, orders, orders_up_to_one
from fracctl.controllers.layout import component_vector, filled, gain_matrix, gain_parameters, order_parameters
from fracctl.controllers.linear import LinearLawTerms
from fracctl.controllers.parameters import Parameter
from fracctl.fractional.terms import FractionalTerm


class PDDAlpha:
    """PDD^α control.

        υ = -K_P ξ - K_D ξ' - K_Dα D^α ξ        (named in Yaylali, Butcher, Sinclair, footnote to Eq. 17)

    D^α is the Caputo derivative from 0, with one order for each component of ξ. In the orbital plane
    ξ'' = S ξ + D ξ' + υ with the Coriolis coupling D = [[0, 2], [-2, 0]]: with K_D = D, or D plus a diagonal matrix,
    and diagonal K_P and K_Dα no term is left that couples u and v, whatever the orders. Without ξ' the law cannot do
    so, for D^α ξ with α < 1 does not cancel ξ'.

    Args:
        k_p: K_P; () or (b,) for one control, (m, m) or (b, m, m) otherwise; 1/time².
        k_d: K_D, shaped as `k_p`; 1/time.
        k_d_alpha: K_Dα, shaped as `k_p`; time^(α-2).
        alpha: orders in (0, 1]; () or (m,), and for a batch (b,) for one control or (b, m) otherwise.

    Raises:
        ArgumentError: a gain is not finite, an order lies outside (0, 1], or a shape is wrong.
    """

    def __init__(self, k_p: ArrayLike, k_d: ArrayLike, k_d_alpha: ArrayLike, alpha: ArrayLike) -> None:
        self.k_p, self.k_d, self.k_d_alpha = finite("k_p", k_p), finite("k_d", k_d), finite("k_d_alpha", k_d_alpha)
        self.alpha = orders_up_to_one("alpha", alpha)

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        """Return -K_P D⁰ - K_D D¹ - K_Dα D^α."""
        names = ("k_p", "k_d", "k_d_alpha")
        exponents = (np.zeros(n_controls), np.ones(n_controls), orders("alpha", self.alpha, n_controls))
        gains = (-matrices(name, getattr(self, name), n_controls) for name in names)
        return LinearLawTerms(tuple(map(FractionalTerm, gains, exponents)))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return alpha_…, k_p_…, k_d_…, k_d_alpha_… for the given components, in the order of the tables' columns."""
        prefixes = ("k_p", "k_d", "k_d_alpha")
        gains = [parameter for prefix in prefixes for parameter in gain_parameters(prefix, components)]
        return tuple(order_parameters("alpha", components) + gains)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> PDDAlpha:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        k_p, k_d, k_d_alpha = (gain_matrix(table, prefix, components) for prefix in ("k_p", "k_d", "k_d_alpha"))
        return cls(k_p, k_d, k_d_alpha, component_vector(table, "alpha", components))
