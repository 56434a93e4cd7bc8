"""Proportional control with a derivative of fractional order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite, matrices, orders
from fracctl.controllers.linear import LinearLawTerms
from fracctl.controllers.parameters import Parameter, entry_names
from fracctl.errors import ArgumentError
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
        self.alpha = finite("alpha", alpha)
        outside = self.alpha[(self.alpha <= 0.0) | (self.alpha > 1.0)]
        if outside.size:
            raise ArgumentError("alpha", float(outside.flat[0]), "must lie in (0, 1]")

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        """Return -K_P D⁰ - K_D D^α."""
        k_p, k_d = matrices("k_p", self.k_p, n_controls), matrices("k_d", self.k_d, n_controls)
        proportional = FractionalTerm(-k_p, np.zeros(n_controls))
        derivative = FractionalTerm(-k_d, orders("alpha", self.alpha, n_controls))
        return LinearLawTerms(control=(proportional, derivative))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return alpha_…, k_p_…, k_d_… for the given components, in the order of the tables' columns."""
        alphas = [
            Parameter(f"alpha_{c}", default=1.0, lower=0.0, upper=1.0, lower_allowed=False, kind="order")
            for c in components
        ]
        gains = [Parameter(name) for p in ("k_p", "k_d") for row in entry_names(p, components) for name in row]
        return tuple(alphas + gains)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> PDAlpha:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = {p.name: finite(p.name, values.get(p.name, p.default)) for p in cls.parameters(components)}
        alpha = np.stack(np.broadcast_arrays(*[table[f"alpha_{c}"] for c in components]), axis=-1)
        if len(components) == 1:
            c = components[0]
            return cls(table[f"k_p_{c}"], table[f"k_d_{c}"], alpha[..., 0] if alpha.ndim > 1 else alpha)
        return cls(_matrix(table, "k_p", components), _matrix(table, "k_d", components), alpha)


def _matrix(table: Mapping[str, Floats], prefix: str, components: Sequence[str]) -> Floats:
    names = entry_names(prefix, components)
    flat = np.broadcast_arrays(*[table[name] for row in names for name in row])
    return np.stack(flat, axis=-1).reshape(*flat[0].shape, len(components), len(components))
