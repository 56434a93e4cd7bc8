"""A linear law with memory as it runs on board: sampled, held, and late."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array

from fracctl.arrays import Floats, positive
from fracctl.controllers.linear import LinearLaw, LinearLawTerms
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.terms import FractionalTerm
from fracctl.plants.state import StatePlant
from fracctl.sampled.controller import DiscreteController
from fracctl.sampled.operators import Memory, SampledOperator, Sparse, difference, first_order_hold, trapezoid


@dataclass(frozen=True)
class SampledLaw:
    """A law of linear fractional terms that is told positions and velocities every period.

    Its control is held from one sample to the next (zero-order hold). Fed by ``position``, derivatives are taken of the
    measured positions: the memory's for orders below 1, the backward difference for order 1. Fed by ``velocity``, the
    measured velocity is the derivative of order 1, and D^α ξ = I^(1-α) ξ', Caputo's definition. Integrals and filters
    are exact for measurements that are linear between samples.

    Args:
        law: e.g. `fracctl.controllers.PDAlpha(0.85, 2.0, 0.91)`; a single one.
        memory: `Window`, `Oustaloup` or `Exponentials`, for orders that are not whole.
        period: T_s, dimensionless; see `dimensionless_time`.
        delay: from a measurement to the control that answers it, in periods; any number from 0 on.
        feed: ``position`` or ``velocity``.

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    law: LinearLaw
    memory: Memory
    period: float
    delay: float = 0.0
    feed: Literal["position", "velocity"] = "position"

    def __post_init__(self) -> None:
        positive("period", self.period)
        if not (math.isfinite(self.delay) and self.delay >= 0.0):
            raise ArgumentError("delay", self.delay, "must not be negative")
        if self.feed not in ("position", "velocity"):
            raise ArgumentError("feed", repr(self.feed), "must be 'position' or 'velocity'")

    def discrete(self, n_controls: int) -> DiscreteController:
        """Return the controller for a plant with m = `n_controls` positions.

        Raises:
            UnsupportedError: the law is a batch, or has terms that cannot be sampled.
        """
        terms = self.law.linear_terms(n_controls)
        parts = _Parts(n_controls)
        for term in terms.control:
            matrix, orders = _single(term)
            for j in np.flatnonzero(matrix[:, :n_controls].any(axis=0)):
                self._add(parts, int(j), float(orders[j]), matrix[:, j])
            if (orders[n_controls:] != 0.0)[matrix[:, n_controls:].any(axis=0)].any():
                raise UnsupportedError("a sampled law cannot differentiate the states of its filters")
        self._add_filters(parts, terms)
        return parts.controller(self.period, self.delay)

    def _add(self, parts: _Parts, j: int, order: float, gain: Floats) -> None:
        """Add gain times D^order of position j."""
        m, h, by_velocity = parts.m, self.period, self.feed == "velocity"
        if order == 0.0:
            parts.d[:, j] += gain
        elif order == 1.0 and by_velocity:
            parts.d[:, m + j] += gain
        elif order == 1.0:
            parts.add(difference(h), j, gain)
        elif 0.0 < order < 1.0 and by_velocity:
            parts.add(self.memory.integral(1.0 - order, h), m + j, gain)
        elif 0.0 < order < 1.0:
            parts.add(self.memory.derivative(order, h), j, gain)
        elif -1.0 <= order < 0.0:
            integral = trapezoid(h) if order == -1.0 else self.memory.integral(-order, h)
            parts.add(integral, j, gain, integral=True)
        else:
            raise UnsupportedError(f"a sampled law has derivatives of orders up to 1, not {order:g}")

    def _add_filters(self, parts: _Parts, terms: LinearLawTerms) -> None:
        """Add z' = -r z + H_0 ξ + H_1 ξ' with what the control takes of z."""
        m, q = parts.m, terms.n_auxiliary
        if not q:
            return
        inputs, coupling = np.zeros((q, 2 * m)), np.zeros((q, q))
        for term in terms.auxiliary:
            matrix, orders = _single(term)
            wrong = ~np.isin(orders, np.repeat([0.0, 1.0], [1, 1])) & matrix.any(axis=0)
            if wrong.any() or ((orders[m:] != 0.0) & matrix[:, m:].any(axis=0)).any():
                raise UnsupportedError("a sampled law's filters may be fed by positions and velocities only")
            coupling += matrix[:, m:]
            for j in range(m):
                inputs[:, j + m * int(orders[j] == 1.0)] += matrix[:, j]
        rates = -np.diag(coupling)
        if (coupling != -np.diag(rates)).any() or (rates < 0.0).any() or np.any(terms.auxiliary_initial):
            raise UnsupportedError("a sampled law's filters must decay, each by itself, from 0")
        direct = np.zeros((q, 2 * m))
        if self.feed == "position":  # z - H_1 ξ needs no velocity
            direct[:, :m] = inputs[:, m:]
            inputs = np.concatenate([inputs[:, :m] - rates[:, None] * inputs[:, m:], np.zeros((q, m))], axis=1)
        decay, earlier, present = first_order_hold(rates, self.period)
        now = direct + present[:, None] * inputs
        gain = sum((_single(term)[0][:, m:] for term in terms.control), np.zeros((m, q)))
        parts.append(csr_array(diags_array(decay)), (earlier + decay * present)[:, None] * inputs, gain, -now)
        parts.d += gain @ now


class _Parts:
    """The parts of a controller, side by side."""

    def __init__(self, n_controls: int) -> None:
        self.m, self.d = n_controls, np.zeros((n_controls, 2 * n_controls))
        self._blocks: list[tuple[Sparse, Floats, Floats, Floats]] = []
        self._integral_of: list[int] = []

    def add(self, operator: SampledOperator, signal: int, gain: Floats, *, integral: bool = False) -> None:
        """Add gain times an operator on one of the measurements."""
        pick = np.eye(2 * self.m)[signal]
        self.append(
            operator.a,
            np.outer(operator.b, pick),
            np.outer(gain, operator.c),
            np.outer(operator.e, pick),
            integral_of=signal if integral else -1,
        )
        self.d[:, signal] += gain * operator.f

    def append(self, a: Sparse, b: Floats, c: Floats, e: Floats, *, integral_of: int = -1) -> None:
        """Add states."""
        self._blocks.append((a, b, c, e))
        self._integral_of += [integral_of] * len(b)

    def controller(self, period: float, delay: float) -> DiscreteController:
        """Return all of them as one."""
        m = self.m
        none = np.zeros((0, 2 * m))
        a, b, c, e = zip((csr_array((0, 0)), none, none.T[:m], none), *self._blocks, strict=True)
        whole = (csr_array(block_diag(a)), np.concatenate(b), np.concatenate(c, axis=1), self.d, np.concatenate(e))
        return DiscreteController(*whole, np.array(self._integral_of, dtype=int), period, delay)


def dimensionless_time(plant: StatePlant, seconds: float) -> float:
    """Return a time in the unit of a plant, e.g. a sample period for `SampledLaw`.

    Raises:
        UnsupportedError: the plant has no units.
    """
    if plant.scales is None:
        raise UnsupportedError(f"{plant} has no unit of time; give it scales, or the time in its own unit")
    return seconds / plant.scales.time_s


def _single(term: FractionalTerm) -> tuple[Floats, Floats]:
    """Return matrix and orders of a term.

    Raises:
        UnsupportedError: it is a batch.
    """
    if (term.batch or 1) > 1:
        raise UnsupportedError(f"a sampled law is a single one, but this is a batch of {term.batch}")
    matrix = term.matrix[0] if term.matrix.ndim == 3 else term.matrix
    return matrix, term.orders[0] if term.orders.ndim == 2 else term.orders
