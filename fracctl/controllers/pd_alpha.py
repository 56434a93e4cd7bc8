"""Proportional control with a derivative of fractional order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import finite, matrices, orders, orders_up_to_one
from fracctl.controllers.layout import component_vector, filled, gain_matrix, gain_parameters, order_parameters
from fracctl.controllers.linear import LinearLawTerms
from fracctl.controllers.parameters import Parameter
from fracctl.fractional.terms import FractionalTerm


class PDAlpha:
    """PD^α control; α = 1 is PD.

        υ = -K_P ξ - K_D D^α ξ        (Yaylali, Butcher, Sinclair, Eq. 15)

    D^α is the Caputo derivative from 0, with one order for each component of ξ.

    Args:
        k_p: K_P; () or (b,) for one control, (m, m) or (b, m, m) otherwise; 1/time².
        k_d: K_D, shaped as `k_p`; time^(α-2).
        alpha: orders in (0, 1]; () or (m,), and for a batch (b,) for one control or (b, m) otherwise.

    Raises:
        ArgumentError: a gain is not finite, an order lies outside (0, 1], or a shape is wrong.
    """

    def __init__(self, k_p: ArrayLike, k_d: ArrayLike, alpha: ArrayLike = 1.0) -> None:
        self.k_p = finite("k_p", k_p)
        self.k_d = finite("k_d", k_d)
        self.alpha = orders_up_to_one("alpha", alpha)

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        """Return -K_P D⁰ - K_D D^α."""
        k_p, k_d = matrices("k_p", self.k_p, n_controls), matrices("k_d", self.k_d, n_controls)
        proportional = FractionalTerm(-k_p, np.zeros(n_controls))
        derivative = FractionalTerm(-k_d, orders("alpha", self.alpha, n_controls))
        return LinearLawTerms(control=(proportional, derivative))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return alpha_…, k_p_…, k_d_… for the given components, in the order of the tables' columns."""
        gains = gain_parameters("k_p", components) + gain_parameters("k_d", components)
        return tuple(order_parameters("alpha", components) + gains)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> PDAlpha:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        k_p, k_d = gain_matrix(table, "k_p", components), gain_matrix(table, "k_d", components)
        return cls(k_p, k_d, component_vector(table, "alpha", components))
