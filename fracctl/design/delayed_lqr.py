"""Time-delayed feedback with the gain of a linear-quadratic regulator, whose parameter is a weight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats
from fracctl.controllers.delayed_feedback import GAIN_FACTOR, DelayedFeedback, memory_parameters, with_memory
from fracctl.controllers.layout import filled
from fracctl.controllers.parameters import Parameter
from fracctl.design.state_regulators import lqr_at
from fracctl.plants.state import StatePlant


class DelayedLQR:
    """Time-delayed feedback with the gain K of the regulator that weighs states by Q = I and controls by R = β I.

        u = -K (x(t) - x(t - τ)),        K = R⁻¹ Bᵀ P,        Aᵀ P + P A - P B R⁻¹ Bᵀ P + Q = 0

    A and B are the Jacobians of the plant at time 0, where all states are 0 if that is an equilibrium, else at the
    initial state (Biggs, McInnes, Eqs. 18-19 with constant coefficients). The gains depend on the units: all are
    dimensionless. The regulator is optimal without delay; under delayed feedback its gain is one like others.

    Args:
        table: the numbers of `parameters` by name, () or (b,).
    """

    def __init__(self, table: Mapping[str, Floats]) -> None:
        self.table = dict(table)

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return beta, the factor of the gain, and the numbers of the memory."""
        del components
        beta = Parameter("beta", 1e3, lower=0.0, lower_allowed=False, kind="weight")
        return (beta, GAIN_FACTOR, *memory_parameters())

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> DelayedLQR:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        return cls(filled(cls.parameters(components), values))

    def for_runs(self, plant: StatePlant, states: Floats) -> DelayedFeedback:
        """Return the law with the gains for a plant and initial states (n,) or (b, n)."""
        points = np.atleast_2d(states)
        none = np.zeros((1, plant.n_controls))
        rest = np.zeros((1, plant.n_states))
        if not plant.rates(np.zeros(1), rest, none).any():
            points = rest
        beta = np.atleast_1d(self.table["beta"])
        points = np.broadcast_to(points, (max(len(points), len(beta)), points.shape[1]))
        pairs = np.column_stack([points, np.broadcast_to(beta, len(points))])
        different, place = np.unique(pairs, axis=0, return_inverse=True)
        gains = np.stack([lqr_at(plant, pair[:-1], r=pair[-1]) for pair in different])[place.ravel()]
        if np.ndim(states) == 1 and self.table["beta"].ndim == 0:
            gains = gains[0]
        return with_memory(gains * self.table["gain_factor"][..., None, None], self.table)
