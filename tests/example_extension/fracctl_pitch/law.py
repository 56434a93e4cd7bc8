"""Tilt-integral-derivative control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import matrices
from fracctl.controllers import Parameter
from fracctl.controllers.layout import filled
from fracctl.controllers.linear import LinearLawTerms
from fracctl.fractional.terms import FractionalTerm


class TID:
    """PID whose proportional part is tilted: an integral of a small order, for a plant with one control.

        u = -k_t I^tilt x - k_i I x - k_d x'        (Lurie, US patent 5371670)

    Args:
        k_t: gain of the tilted part, a number or (b,) for a batch of laws; so are the others.
        k_i: gain of the integral.
        k_d: gain of the derivative.
        tilt: order of the tilted part, in (0, 1].
    """

    def __init__(self, k_t: ArrayLike, k_i: ArrayLike, k_d: ArrayLike, tilt: ArrayLike = 0.5) -> None:
        self.k_t, self.k_i, self.k_d, self.tilt = (np.asarray(value, dtype=float) for value in (k_t, k_i, k_d, tilt))

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        """Return the terms: a matrix with its sign, and the order of the derivative that it multiplies."""
        given = {"k_t": (self.k_t, -self.tilt), "k_i": (self.k_i, -1.0), "k_d": (self.k_d, 1.0)}
        terms = []
        for name, (gain, order) in given.items():
            matrix = matrices(name, gain, n_controls)
            orders = np.asarray(order, dtype=float)[..., None] if gain.any() else np.zeros(1)
            terms.append(FractionalTerm(-matrix, orders))
        return LinearLawTerms(tuple(terms))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return the keys of the configuration, which are the columns of the tables."""
        (name,) = components
        order = Parameter(f"tilt_{name}", 0.5, 0.0, 1.0, lower_allowed=False, kind="order")
        return (order, *(Parameter(f"{gain}_{name}") for gain in ("k_t", "k_i", "k_d")))

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> TID:
        """Build the law from numbers or arrays (b,) by parameter name."""
        (name,) = components
        table = filled(cls.parameters(components), values)
        return cls(*(table[f"{key}_{name}"] for key in ("k_t", "k_i", "k_d", "tilt")))
