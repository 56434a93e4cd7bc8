"""Proportional-integral-derivative control with a filtered derivative."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite, matrices, orders
from fracctl.controllers.layout import component_vector, filled, gain_matrix, gain_parameters
from fracctl.controllers.linear import LinearLawTerms
from fracctl.controllers.parameters import Parameter
from fracctl.errors import ArgumentError
from fracctl.fractional.terms import FractionalTerm


class PID:
    """PID control whose derivative passes a lag of first order.

        υ = -K_P ξ - K_I ∫₀ᵗ ξ - K_D z,        T_f z' = ξ' - z,        z(0) = 0

    z has the transform s/(T_f s + 1) ξ - ξ(0)/(T_f s + 1), with one time constant T_f for each component of ξ: the
    derivative action of Åström and Hägglund, Advanced PID Control (2006), section 3.2, T_f = T_d/N.

    Args:
        k_p: K_P; () or (b,) for one control, (m, m) or (b, m, m) otherwise; 1/time².
        k_i: K_I, shaped as `k_p`; 1/time³.
        k_d: K_D, shaped as `k_p`; 1/time.
        time_constant: T_f > 0; () or (m,), and for a batch (b,) for one control or (b, m) otherwise; time.

    Raises:
        ArgumentError: a gain is not finite, a time constant is not positive, or a shape is wrong.
    """

    def __init__(self, k_p: ArrayLike, k_i: ArrayLike, k_d: ArrayLike, time_constant: ArrayLike) -> None:
        self.k_p, self.k_i, self.k_d = finite("k_p", k_p), finite("k_i", k_i), finite("k_d", k_d)
        self.time_constant = finite("time_constant", time_constant)
        wrong = self.time_constant[self.time_constant <= 0.0]
        if wrong.size:
            raise ArgumentError("time_constant", float(wrong.flat[0]), "must be positive")

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        """Return -K_P D⁰ξ - K_I D⁻¹ξ - K_D D⁰z with m auxiliary states z."""
        m = n_controls
        gains = {name: matrices(name, getattr(self, name), m) for name in ("k_p", "k_i", "k_d")}
        lag = orders("time_constant", self.time_constant, m)
        rate = np.eye(m) / lag[..., None]
        none, integral = np.zeros(2 * m), np.repeat([-1.0, 0.0], m)
        control = (
            FractionalTerm(_over_positions(-gains["k_p"]), none),
            FractionalTerm(_over_positions(-gains["k_i"]), integral if gains["k_i"].any() else none),
            FractionalTerm(_over_lags(-gains["k_d"]), none),
        )
        auxiliary = (
            FractionalTerm(_over_positions(rate), np.repeat([1.0, 0.0], m)),
            FractionalTerm(_over_lags(-rate), none),
        )
        return LinearLawTerms(control, auxiliary, np.zeros(m))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return time_constant_…, k_p_…, k_i_…, k_d_… for the given components, in the order of the tables' columns."""
        lags = [
            Parameter(f"time_constant_{c}", default=0.1, lower=0.0, lower_allowed=False, kind="time")
            for c in components
        ]
        gains = [parameter for prefix in ("k_p", "k_i", "k_d") for parameter in gain_parameters(prefix, components)]
        return tuple(lags + gains)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> PID:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        k_p, k_i, k_d = (gain_matrix(table, prefix, components) for prefix in ("k_p", "k_i", "k_d"))
        return cls(k_p, k_i, k_d, component_vector(table, "time_constant", components))


def _over_positions(matrix: Floats) -> Floats:
    """Return [matrix, 0], over [ξ, z]."""
    return np.concatenate([matrix, np.zeros_like(matrix)], axis=-1)


def _over_lags(matrix: Floats) -> Floats:
    """Return [0, matrix], over [ξ, z]."""
    return np.concatenate([np.zeros_like(matrix), matrix], axis=-1)
