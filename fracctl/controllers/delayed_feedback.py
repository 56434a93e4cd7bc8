"""Time-delayed feedback: the control is what the state has changed by since one delay ago."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Booleans, Floats, batch_size, finite
from fracctl.controllers.layout import filled
from fracctl.controllers.parameters import Parameter
from fracctl.errors import ArgumentError
from fracctl.plants.state import StatePlant

GAIN_FACTOR = Parameter("gain_factor", 1.0)
"""Multiplies all gains of a law; 0 is free motion."""

History = Callable[[Floats], Floats]
"""Takes times (b, k) before 0 and returns states (b, k, n), or what broadcasts to them."""
GainFunction = Callable[[Floats], Floats]
"""Takes times (b, k) and returns gains (b, k, m, n), or what broadcasts to them."""


@dataclass(frozen=True)
class Window:
    """What a run has stored of the delay that has just ended."""

    plant: StatePlant
    start: Floats
    """First time, (b,)."""
    length: Floats
    """The delay, (b,)."""
    states: Callable[[Floats], Floats]
    """Takes times (b, k) of the window and returns states (b, k, n)."""


@dataclass(frozen=True)
class DelayedTerm:
    """One term -K (x - W) of a control, with W(t) = (1 - R) x(t - τ) + R W(t - τ), from `switch_on` on."""

    gain: Floats
    """K, (m, n) or (b, m, n)."""
    delay: Floats
    """τ, () or (b,)."""
    recall: Floats
    """R, () or (b,)."""
    switch_on: Floats
    """() or (b,)."""
    schedule: GainFunction | None = None
    """K(t), where it is not constant; `gain` then has its shape only."""
    on_segment: Callable[[Window], GainFunction] | None = None
    """Asked at the end of each delay for the K(t) of the next one."""
    adapts: bool = False
    """Whether the delay is only the one that it begins with."""

    @property
    def batch(self) -> int | None:
        """Batch size, None for a single law."""
        return batch_size(
            gain=(self.gain, 2), delay=(self.delay, 0), recall=(self.recall, 0), switch_on=(self.switch_on, 0)
        )

    def of(self, batch: int) -> DelayedTerm:
        """Return the term with a batch axis of the given size everywhere."""
        gain = np.ascontiguousarray(np.broadcast_to(self.gain, (batch, *self.gain.shape[-2:])))
        delay, recall, switch_on = (np.broadcast_to(v, (batch,)) for v in (self.delay, self.recall, self.switch_on))
        return replace(self, gain=gain, delay=delay, recall=recall, switch_on=switch_on)

    def gains(self, times: Floats) -> Floats:
        """Return K at times (b, k) of a term with batch axes, (b, k, m, n)."""
        values = self.gain[:, None] if self.schedule is None else self.schedule(times)
        return np.broadcast_to(values, (*times.shape, *self.gain.shape[-2:]))


@runtime_checkable
class DelayedLaw(Protocol):
    """A law that is a sum of delayed terms."""

    history: History | None
    """The states before time 0; None where the law does not ask for them."""
    history_breaks: tuple[float, ...]
    """Times in (-τ, 0) at which the history is not smooth."""

    def delayed_terms(self, n_states: int, n_controls: int) -> tuple[DelayedTerm, ...]:
        """Return the terms for a plant with n states and m controls."""
        ...


class DelayedFeedback:
    """Time-delayed feedback control (Pyragas; Biggs and McInnes, Eq. 1), or with a recall its extended form (Socolar).

        u(t) = -K (x(t) - W(t)),        W(t) = (1 - R) x(t - τ) + R W(t - τ),        t ≥ switch_on

    and u = 0 before. An orbit of period τ needs no control. W = x as long as x(t - τ) is not known.

    Args:
        gain: K, (m, n), or (b, m, n) for a batch; a control over a state. Or a function K(t) of times (b, k) that
            returns (b, k, m, n), smooth but for multiples of τ, e.g. `fracctl.design.periodic_regulator`.
        delay: τ > 0, () or (b,); time.
        switch_on: when control begins, () or (b,); None for τ. It may be earlier than τ only with a history.
        history: the states before time 0: None for a free motion that begins at time 0, a constant () or (n,), or a
            function of times (b, k) that returns states (b, k, n).
        recall: R in [0, 1), () or (b,); 0 for the plain law.
        history_breaks: times in (-τ, 0) at which a history given as a function jumps or has a kink.

    Raises:
        ArgumentError: a number is out of its range, control begins before there is anything to compare with, or (where
            the plant is known) the gain has a wrong shape.
    """

    def __init__(
        self,
        gain: ArrayLike | GainFunction,
        delay: ArrayLike,
        switch_on: ArrayLike | None = None,
        history: ArrayLike | History | None = None,
        recall: ArrayLike = 0.0,
        history_breaks: ArrayLike = (),
    ) -> None:
        self.schedule = gain if callable(gain) else None
        self.gain = _at_time_zero(gain) if callable(gain) else finite("gain", gain)
        self.delay = finite("delay", delay)
        self.switch_on = self.delay if switch_on is None else finite("switch_on", switch_on)
        self.recall = finite("recall", recall)
        breaks = np.atleast_1d(finite("history_breaks", history_breaks))
        self.history_breaks = tuple(float(b) for b in breaks)
        self.history = _history(history)
        _all("delay", self.delay, self.delay > 0.0, "must be positive")
        _all("recall", self.recall, (self.recall >= 0.0) & (self.recall < 1.0), "must lie in [0, 1)")
        early = self.switch_on < (self.delay if self.history is None else 0.0)
        allowed = "must not lie before time 0" if self.history else "must not lie before the delay without a history"
        _all("switch_on", self.switch_on, ~early, allowed)
        for name in ("delay", "recall", "switch_on"):
            if getattr(self, name).ndim > 1:
                raise ArgumentError(name, f"of shape {getattr(self, name).shape}", "must have shape () or (b,)")

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return gain_i_j (control i, state j), their common factor, and the numbers of `memory_parameters`."""
        return (*gain_parameters(len(components)), *memory_parameters())

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> DelayedFeedback:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        return with_memory(gain_of(table, len(components)), table)

    def delayed_terms(self, n_states: int, n_controls: int) -> tuple[DelayedTerm, ...]:
        """Return the one term of the law.

        Raises:
            ArgumentError: the gain does not fit.
        """
        if self.gain.ndim not in (2, 3) or self.gain.shape[-2:] != (n_controls, n_states):
            shape = f"({n_controls}, {n_states})"
            allowed = f"must have shape {shape} or (b, {n_controls}, {n_states}) for this plant"
            raise ArgumentError("gain", f"of shape {self.gain.shape}", allowed)
        return (DelayedTerm(self.gain, self.delay, self.recall, self.switch_on, self.schedule),)


class DelayedSum:
    """The sum of several delayed feedbacks, each with a delay of its own; they share the history of the first.

    Args:
        laws: two or more.

    Raises:
        ArgumentError: there are fewer than two, or another than the first has a history.
    """

    def __init__(self, *laws: DelayedFeedback) -> None:
        if len(laws) < 2:
            raise ArgumentError("laws", f"a number of {len(laws)}", "must be two or more")
        if any(law.history is not None or law.history_breaks for law in laws[1:]):
            allowed = "must be given with the first, and so its breaks"
            raise ArgumentError("history", "given with another than the first law", allowed)
        self.laws = laws
        self.history, self.history_breaks = laws[0].history, laws[0].history_breaks

    def delayed_terms(self, n_states: int, n_controls: int) -> tuple[DelayedTerm, ...]:
        """Return the terms of all laws."""
        return tuple(term for law in self.laws for term in law.delayed_terms(n_states, n_controls))


def gain_parameters(n_controls: int) -> list[Parameter]:
    """Return the entries of a gain (m, 2m) row by row, ``gain_1_1`` …, and ``gain_factor``, which multiplies all."""
    entries = [Parameter(f"gain_{i + 1}_{j + 1}") for i in range(n_controls) for j in range(2 * n_controls)]
    return [*entries, GAIN_FACTOR]


def memory_parameters() -> list[Parameter]:
    """Return delay τ, recall R, and ``switch_on_delays``: how many delays after time 0 control begins."""
    return [
        Parameter("delay", 2.0 * math.pi, lower=0.0, lower_allowed=False, kind="time"),
        Parameter("recall", 0.0, lower=0.0, upper=1.0, upper_allowed=False),
        Parameter("switch_on_delays", 1.0, lower=1.0, kind="time"),
    ]


def gain_of(table: Mapping[str, Floats], n_controls: int) -> Floats:
    """Return K of `gain_parameters`, (m, 2m) or (b, m, 2m)."""
    names = [parameter.name for parameter in gain_parameters(n_controls)]
    *entries, factor = np.broadcast_arrays(*[table[name] for name in names])
    gain: Floats = np.stack(entries, axis=-1) * factor[..., None]
    return gain.reshape(*factor.shape, n_controls, 2 * n_controls)


def with_memory(gain: ArrayLike, table: Mapping[str, Floats]) -> DelayedFeedback:
    """Return the law with a gain and the numbers of `memory_parameters`."""
    delay = table["delay"]
    return DelayedFeedback(gain, delay, switch_on=table["switch_on_delays"] * delay, recall=table["recall"])


def _at_time_zero(gain: GainFunction) -> Floats:
    """Return K(0), (m, n) or (b, m, n)."""
    values = finite("gain", gain(np.zeros((1, 1))))
    if values.ndim != 4:
        raise ArgumentError("gain", f"a function that returned {values.shape}", "must return (b, k, m, n) of (b, k)")
    return values[0, 0] if len(values) == 1 else values[:, 0]


def _history(given: ArrayLike | History | None) -> History | None:
    if given is None or callable(given):
        return given
    constant = finite("history", given)
    if constant.ndim > 1:
        raise ArgumentError("history", f"of shape {constant.shape}", "must be a function or have shape () or (n,)")
    return lambda times: np.broadcast_to(constant, (*times.shape, constant.size))


def _all(name: str, values: Floats, good: Booleans, allowed: str) -> None:
    wrong = values[~np.broadcast_to(good, values.shape)]
    if wrong.size:
        raise ArgumentError(name, float(wrong.flat[0]), allowed)
