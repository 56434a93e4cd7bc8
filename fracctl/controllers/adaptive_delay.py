"""Time-delayed feedback whose delay seeks the period of the orbit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import finite
from fracctl.controllers.delayed_feedback import DelayedFeedback, DelayedTerm, gain_of
from fracctl.controllers.layout import filled
from fracctl.controllers.parameters import Parameter
from fracctl.errors import ArgumentError


class AdaptiveDelayedFeedback(DelayedFeedback):
    """u(t) = -K e(t), e(t) = x(t) - x(t - τ(t)), from `switch_on` on, with a delay that descends the slope of |e|².

        always:     τ' = -γ eᵀ x'(t - τ)
        per_orbit:  τ ← τ - γ ∫ eᵀ x'_τ dt / ∫ |x'_τ|² dt after each τ, x'_τ = x'(t - τ)

    Both follow the gradient of ½|e|², the second that of its integral by Gauss and Newton. Near an orbit of period T
    e is about x' (τ - T): the first form converges like exp(-γ ∫ |x'|² dt), the second multiplies τ - T by 1 - γ after
    each orbit, as far as the control leaves the orbit as it is. Far from any orbit the slope leads anywhere, τ = 0
    included: `adapt_from` lets the control find the neighbourhood of an orbit first.

    Args:
        gain: K, (m, n), or (b, m, n) for a batch; a control over a state.
        delay: τ until `switch_on`, () or (b,); time.
        rate: γ ≥ 0, () or (b,); time over the square of a state for ``always``, a number for ``per_orbit``.
        renewal: ``always`` or ``per_orbit``.
        switch_on: when control begins, () or (b,), not before the delay; None for the delay.
        adapt_from: when adaptation begins, () or (b,), not before `switch_on`; None for `switch_on`.

    Raises:
        ArgumentError: a number is out of its range, or `renewal` is another word.
    """

    def __init__(
        self,
        gain: ArrayLike,
        delay: ArrayLike,
        rate: ArrayLike = 0.5,
        renewal: Literal["always", "per_orbit"] = "per_orbit",
        switch_on: ArrayLike | None = None,
        adapt_from: ArrayLike | None = None,
    ) -> None:
        super().__init__(gain, delay, switch_on)
        if renewal not in ("always", "per_orbit"):
            raise ArgumentError("renewal", repr(renewal), "must be 'always' or 'per_orbit'")
        self.rate, self.renewal = finite("rate", rate), renewal
        self.adapt_from = self.switch_on if adapt_from is None else finite("adapt_from", adapt_from)
        if self.adapt_from.ndim > 1 or (self.adapt_from < self.switch_on.min()).any():
            allowed = "must not lie before the switch-on, of shape () or (b,)"
            raise ArgumentError("adapt_from", self.adapt_from.tolist(), allowed)
        if self.rate.ndim > 1 or (self.rate < 0.0).any():
            raise ArgumentError("rate", self.rate.tolist(), "must not be negative, of shape () or (b,)")

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return the parameters of `DelayedFeedback`, then ``adaptation_rate`` γ and ``adapt_from_delays``.

        The delay adapts per orbit, from so many first delays after time 0 on.
        """
        rate = Parameter("adaptation_rate", 0.5, lower=0.0)
        first = Parameter("adapt_from_delays", 1.0, lower=1.0, kind="time")
        return (*DelayedFeedback.parameters(components), rate, first)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> AdaptiveDelayedFeedback:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults.

        Raises:
            ArgumentError: there is a recall, which does not go with a delay that adapts.
        """
        table = filled(cls.parameters(components), values)
        if table["recall"].any():
            raise ArgumentError("recall", float(table["recall"].max()), "must be 0 where the delay adapts")
        delay, gain = table["delay"], gain_of(table, len(components))
        switch_on, first = table["switch_on_delays"] * delay, table["adapt_from_delays"] * delay
        return cls(gain, delay, table["adaptation_rate"], switch_on=switch_on, adapt_from=np.maximum(first, switch_on))

    def delayed_terms(self, n_states: int, n_controls: int) -> tuple[DelayedTerm, ...]:
        """Return the one term of the law, with the delay it begins with.

        Raises:
            ArgumentError: the gain does not fit.
        """
        term = replace(super().delayed_terms(n_states, n_controls)[0], adapts=True)
        if self.rate.ndim == 0 or len(self.rate) == 1 or term.delay.shape == self.rate.shape:
            return (term,)
        if term.delay.ndim and len(term.delay) > 1:
            raise ArgumentError(
                "rate", f"of shape {self.rate.shape}", f"must have the shape of `delay`, {term.delay.shape}"
            )
        delay = np.array(np.broadcast_to(term.delay, self.rate.shape))
        return (replace(term, delay=delay),)
