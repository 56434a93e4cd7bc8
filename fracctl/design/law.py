"""The linear-quadratic regulator as a law, whose parameters are weights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import finite
from fracctl.controllers.layout import component_vector, filled
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd import PD
from fracctl.design.lqr import gains_by_name, lqr
from fracctl.design.regulators import regulators
from fracctl.plants.linear import LinearPlant


class LQR:
    """PD control with the gains of the linear-quadratic regulator.

        υ = -K_P ξ - K_D ξ',        [K_P K_D] minimises ∫ (xᵀ Q x + υᵀ R υ) ds,        x = [ξ, ξ']

    Args:
        q: diagonal of Q ≥ 0; () for a multiple of the identity, (2m,), or (b, 2m) for a batch.
        r: diagonal of R > 0; (), (m,) or (b, m).

    Raises:
        ArgumentError: a weight is not finite. Wrong signs and shapes are refused where the plant is known.
    """

    def __init__(self, q: ArrayLike = 1.0, r: ArrayLike = 1.0) -> None:
        self.q = finite("q", q)
        self.r = finite("r", r)

    def for_plant(self, plant: LinearPlant) -> PD:
        """Return the law with the gains for a plant."""
        if max(self.q.ndim, self.r.ndim) < 2:
            gains = lqr(plant, self.q, self.r)
        else:
            q, r = (np.atleast_2d(weight) for weight in (self.q, self.r))
            size = max(len(q), len(r))
            gains = regulators(plant, np.broadcast_to(q, (size, q.shape[1])), np.broadcast_to(r, (size, r.shape[1])))
        return PD.from_parameters(plant.components, gains_by_name(plant.components, gains))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return q_… of positions and rates, then r_… for the given components, in the order of the tables' columns."""
        states = (*components, *(f"{c}_dot" for c in components))
        weights = [Parameter(f"q_{state}", 1.0, lower=0.0, kind="weight") for state in states]
        costs = [Parameter(f"r_{c}", 1.0, lower=0.0, lower_allowed=False, kind="weight") for c in components]
        return (*weights, *costs)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> LQR:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones are 1."""
        table = filled(cls.parameters(components), values)
        states = (*components, *(f"{c}_dot" for c in components))
        return cls(component_vector(table, "q", states), component_vector(table, "r", components))
