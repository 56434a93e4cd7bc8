"""Proportional control with an integral and a derivative of fractional orders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import finite, matrices, orders, orders_up_to_one
from fracctl.controllers.layout import component_vector, filled, gain_matrix, gain_parameters, order_parameters
from fracctl.controllers.linear import LinearLawTerms
from fracctl.controllers.parameters import Parameter
from fracctl.fractional.terms import FractionalTerm


class PILambdaDMu:
    """PI^λD^μ control.

        υ = -K_P ξ - K_I I^λ ξ - K_D D^μ ξ        (Podlubny, IEEE Trans. Autom. Control 44 (1999) 208)

    I^λ is the Riemann-Liouville integral, D^μ the Caputo derivative, both from 0, with one order each for each
    component of ξ. λ = μ = 1 is PID with the exact derivative; K_I = 0 is PD^μ.

    Args:
        k_p: K_P; () or (b,) for one control, (m, m) or (b, m, m) otherwise; 1/time².
        k_i: K_I, shaped as `k_p`; time^(-λ-2).
        k_d: K_D, shaped as `k_p`; time^(μ-2).
        integral_order: λ in (0, 1]; () or (m,), and for a batch (b,) for one control or (b, m) otherwise.
        derivative_order: μ in (0, 1], shaped as `integral_order`.

    Raises:
        ArgumentError: a gain is not finite, an order lies outside (0, 1], or a shape is wrong.
    """

    def __init__(
        self,
        k_p: ArrayLike,
        k_i: ArrayLike,
        k_d: ArrayLike,
        integral_order: ArrayLike = 1.0,
        derivative_order: ArrayLike = 1.0,
    ) -> None:
        self.k_p, self.k_i, self.k_d = finite("k_p", k_p), finite("k_i", k_i), finite("k_d", k_d)
        self.integral_order = orders_up_to_one("integral_order", integral_order)
        self.derivative_order = orders_up_to_one("derivative_order", derivative_order)

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        """Return -K_P D⁰ - K_I D^(-λ) - K_D D^μ."""
        k_p, k_i, k_d = (matrices(name, getattr(self, name), n_controls) for name in ("k_p", "k_i", "k_d"))
        integral = -orders("integral_order", self.integral_order, n_controls)
        derivative = orders("derivative_order", self.derivative_order, n_controls)
        return LinearLawTerms(
            (
                FractionalTerm(-k_p, np.zeros(n_controls)),
                FractionalTerm(-k_i, integral if k_i.any() else np.zeros_like(integral)),
                FractionalTerm(-k_d, derivative),
            )
        )

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return lambda_…, mu_…, k_p_…, k_i_…, k_d_… for the given components, in the order of the tables' columns."""
        exponents = order_parameters("lambda", components) + order_parameters("mu", components)
        gains = [parameter for prefix in ("k_p", "k_i", "k_d") for parameter in gain_parameters(prefix, components)]
        return tuple(exponents + gains)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> PILambdaDMu:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        k_p, k_i, k_d = (gain_matrix(table, prefix, components) for prefix in ("k_p", "k_i", "k_d"))
        integral, derivative = (component_vector(table, prefix, components) for prefix in ("lambda", "mu"))
        return cls(k_p, k_i, k_d, integral, derivative)
