"""Delayed feedback whose gains are designed anew, in each delay, on the motion that was stored in the one before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, batch_size, finite
from fracctl.controllers.delayed_feedback import (
    GAIN_FACTOR,
    DelayedFeedback,
    DelayedTerm,
    GainFunction,
    History,
    Window,
    memory_parameters,
)
from fracctl.controllers.layout import filled
from fracctl.controllers.parameters import Parameter
from fracctl.design.lqr import weight
from fracctl.design.state_regulators import regulator_on
from fracctl.errors import ArgumentError


class WindowedRegulator:
    """Time-delayed feedback u = -K(t) (x - W), K(t) from the backward Riccati equation on the last stored delay.

    At t = kτ the motion on [(k-1)τ, kτ] is taken for one period of a periodic orbit; K on [kτ, (k+1)τ] is the regulator
    of the plant linearised about it (`fracctl.design.periodic_regulator`), with R = β I. Where that has no solution the
    member diverges. Near an orbit of period τ the multipliers are those of the regulator on the orbit: what K changes
    by meets x - W = 0.

    Args:
        delay: τ > 0, () or (b,).
        beta: β > 0, () or (b,).
        q: Q ≥ 0; a number, its diagonal (n,), or (n, n).
        switch_on: when control begins, () or (b,), not before τ; None for τ.
        recall: R in [0, 1) of W, () or (b,).
        nodes: Chebyshev nodes in a delay.
        factor: multiplies K, () or (b,); 0 is free motion.

    Raises:
        ArgumentError: a number is out of its range. Q is checked where the plant is known.
    """

    history: History | None = None
    history_breaks: tuple[float, ...] = ()

    def __init__(
        self,
        delay: ArrayLike,
        beta: ArrayLike = 1e3,
        q: ArrayLike = 1.0,
        switch_on: ArrayLike | None = None,
        recall: ArrayLike = 0.0,
        nodes: int = 64,
        factor: ArrayLike = 1.0,
    ) -> None:
        law = DelayedFeedback(0.0, delay, switch_on, recall=recall)
        self.delay, self.switch_on, self.recall = law.delay, law.switch_on, law.recall
        self.beta, self.q, self.nodes = finite("beta", beta), finite("q", q), nodes
        self.factor = finite("factor", factor)
        if self.beta.ndim > 1 or not (self.beta > 0.0).all():
            raise ArgumentError("beta", np.asarray(beta).tolist(), "must be positive, of shape () or (b,)")

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return beta, the factor of the gain, and the numbers of the memory."""
        del components
        return (
            Parameter("beta", 1e3, lower=0.0, lower_allowed=False, kind="weight"),
            GAIN_FACTOR,
            *memory_parameters(),
        )

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> WindowedRegulator:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        switch_on = table["switch_on_delays"] * table["delay"]
        recall, factor = table["recall"], table["gain_factor"]
        return cls(table["delay"], table["beta"], switch_on=switch_on, recall=recall, factor=factor)

    def delayed_terms(self, n_states: int, n_controls: int) -> tuple[DelayedTerm, ...]:
        """Return the one term of the law, whose gains are still to come."""
        q, one = weight("q", self.q, n_states), np.eye(n_controls)

        def on_segment(window: Window) -> GainFunction:
            r = np.atleast_1d(self.beta)[:, None, None] * one
            stored = regulator_on(window, q, r, self.nodes)
            start = window.start + window.length
            factor = np.reshape(self.factor, (-1, 1, 1, 1))
            return lambda times: (
                factor * stored.at(np.clip((times - start[:, None]) / window.length[:, None], 0.0, 1.0))
            )

        size = batch_size(beta=(self.beta, 0), delay=(self.delay, 0), factor=(self.factor, 0))
        shape = (n_controls, n_states) if size is None else (size, n_controls, n_states)
        empty: Floats = np.zeros(shape)
        return (DelayedTerm(empty, self.delay, self.recall, self.switch_on, on_segment=on_segment),)
