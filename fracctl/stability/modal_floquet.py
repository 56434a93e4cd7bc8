"""Floquet multipliers of linear periodic loops with fractional memory, in sum-of-exponentials form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from fracctl.arrays import Array, Booleans, Complexes, Floats
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.sum_of_exponentials import sum_of_exponentials
from fracctl.loop import ClosedLoop
from fracctl.plants.capabilities import period_of
from fracctl.solvers.explicit_memory.law import signals

_SHORTEST, _LONGEST = 1e-4, 1e3
"""Over a period: what the kernel resolves, and what it remembers."""
_STEPS = 32
_MOST_STEPS = 1024
_REAL = 1e-6
"""Imaginary part over the magnitude up to which a multiplier counts as real."""
_NOTHING = 1e-10
"""Multipliers below this are rounding."""


@dataclass(frozen=True)
class MemoryMultipliers:
    """Multipliers of a loop whose fractional integrals are sums of exponentials."""

    values: Complexes
    """All of them, by descending magnitude: isolated ones, and those of relaxation."""
    isolated: Booleans
    """Those off the essential spectrum, [0, 1], which relaxation fills; for integer orders all."""
    modes: int
    """Number of exponentials a signal."""
    steps: int
    """Steps a period."""
    gap: float
    """The largest change of a multiplier as steps were halved, the last two times, over its size where above 1."""
    converged: bool
    """Whether that is within the tolerance."""

    @property
    def stable(self) -> bool | None:
        """Whether all are inside the unit circle; None where they have not converged."""
        return bool(np.all(np.abs(self.values) < 1.0)) if self.converged else None

    @property
    def largest(self) -> float:
        """The largest magnitude of an isolated one, 0 where there is none; what decides how fast the loop settles."""
        return float(np.abs(self.values[self.isolated]).max(initial=0.0))

    @property
    def slowest_relaxation(self) -> float:
        """The largest of relaxation, 0 for integer orders; it nears 1 the longer the kernel remembers."""
        return float(np.abs(self.values[~self.isolated]).max(initial=0.0))


def memory_multipliers(
    loop: ClosedLoop,
    period: float | None = None,
    kernel_tolerance: float = 1e-6,
    tolerance: float = 1e-7,
    member: int | None = None,
) -> MemoryMultipliers:
    """Return the eigenvalues of the monodromy matrix over [ξ, ξ', z, φ_j].

    Each I^p s of the law is Σ_j w_j φ_j + c s with φ_j' = -s_j φ_j + s: c is the integral of what is left out of the
    kernel because it is faster than 1e-4 of a period. That is a linear system with coefficients of the plant's period,
    whose transition matrix Magnus's expansion of fourth order gives; at constant coefficients it is exact.

    A loop with memory has besides isolated multipliers an essential spectrum, for its tail decays algebraically, slower
    than every exponential. With modes it is the row of relaxation multipliers, real, near e^(-s_j T) and thus below 1:
    the slower the slowest mode, the nearer to 1. They say nothing about stability, but that the verdict is of the
    kernel up to 1000 periods. An isolated one that happens to be real and in (0, 1) is counted to them. For constant
    coefficients the isolated multipliers tend to exp(T σ) of the principal-sheet poles σ as the modes become many: soon
    for those that decide on stability, late for poles next to the cut (-∞, 0], where the modes have poles of their own.

    Args:
        loop: of a plant of second order that is linear in states and controls (Jacobians at 0 are taken),
            under a linear law whose orders of positions are at most 1, of other states at most 0.
        period: T; None for the plant's own.
        kernel_tolerance: relative error of the kernel; fewer modes or more.
        tolerance: of the steps: they are halved until twice no multiplier changes by more, over its size
            where that is above 1, or until a period has 1024; then `converged` is False. Coefficients that jump
            converge fast only where they jump between steps, as at fractions T/2^k of the period.
        member: which one of a batch; None for a single loop.

    Raises:
        ArgumentError: the loop is a batch and no member is named, or there is no period.
        UnsupportedError: the law has higher orders, or is not linear.
    """
    if loop.batch is not None and member is None:
        raise ArgumentError("loop", f"a batch of {loop.batch}", "must be a single loop", "name one by `member`")
    found = period_of(loop.plant) if period is None else period
    if found is None or not found > 0.0:
        raise ArgumentError("period", found, "must be a positive number, for the plant has none of its own")
    form = _ModeForm(loop, member or 0, float(found), kernel_tolerance)
    values, steps, gap = _refined(form, tolerance)
    relaxing = (np.abs(values.imag) <= _REAL * np.abs(values)) & (values.real < 1.0) & (values.real > 0.0)
    isolated = (np.abs(values) > _NOTHING) & ~relaxing if form.modes else np.ones(len(values), dtype=bool)
    return MemoryMultipliers(values, isolated, form.modes, steps, gap, gap <= tolerance)


class _ModeForm:
    """X' = A(t) X for X = [ξ, ξ', z, φ] of a loop."""

    def __init__(self, loop: ClosedLoop, member: int, period: float, tolerance: float) -> None:
        self.loop, self.period = loop, period
        m = loop.plant.n_controls
        law = signals(loop.law_terms, m).take(np.array([member]))
        self._m, q = m, law.n_auxiliary
        states = 2 * m + q
        place = {**{i: i for i in range(2 * m)}, **{3 * m + i: 2 * m + i for i in range(q)}}
        used = law.gains[0].any(axis=0)
        sources, orders, gains = law.sources[used], law.orders[used, 0], law.gains[0][:, used]
        if any(int(source) not in place for source in sources):
            raise UnsupportedError(
                "memory_multipliers takes orders up to 1 of positions and 0 of other states; reduce them"
            )
        deep = [(place[int(s)], float(p)) for s, p in zip(sources, orders, strict=True)]
        kinds = sorted({kind for kind in deep if kind[1] > 0.0})
        rates = {p: _modes(p, period, tolerance) for _, p in kinds}
        first = dict(zip(kinds, states + np.cumsum([0, *(len(rates[p][0]) for _, p in kinds)]), strict=False))
        size = states + sum(len(rates[p][0]) for _, p in kinds)
        self.modes = max((len(rates[p][0]) for _, p in kinds if p < 1.0), default=0)
        self._constant = np.zeros((size, size))
        self._feedback = np.zeros((m + q, size))
        """[w, z'] of X."""
        for source, p in kinds:
            s, _, _ = rates[p]
            rows = first[source, p] + np.arange(len(s))
            self._constant[rows, rows] = -s
            self._constant[rows, source] = 1.0
        for (source, p), gain in zip(deep, gains.T, strict=True):
            if p == 0.0:
                self._feedback[:, source] += gain
                continue
            s, w, rest = rates[p]
            columns = first[source, p] + np.arange(len(s))
            self._feedback[:, columns] += np.outer(gain, w)
            self._feedback[:, source] += rest * gain
        self._constant[2 * m : states] = self._feedback[m:]

    def matrix(self, time: float) -> Floats:
        """Return A."""
        m, plant = self._m, self.loop.plant
        at = np.array([time]), np.zeros((1, 2 * m)), np.zeros((1, m))
        state, control = (np.asarray(part[0]) for part in plant.jacobians(*at))
        out = self._constant.copy()
        out[: 2 * m, : 2 * m] = state
        out[: 2 * m] += control @ self._feedback[:m]
        return out

    def monodromy(self, steps: int) -> Floats:
        """Return Φ(T) by Magnus's expansion, [A₁, A₂] at Gauss's points of each step; e^(A T) where all are equal."""
        h = self.period / steps
        places = h * (np.arange(steps)[:, None] + 0.5 + np.array([-1.0, 1.0]) * math.sqrt(3.0) / 6.0)
        first = self.matrix(0.0)
        if all(np.array_equal(self.matrix(time), first) for time in places.flat):
            return np.asarray(expm(first * self.period))
        total = np.eye(len(self._constant))
        for near, far in places:
            one, two = self.matrix(near), self.matrix(far)
            total = expm(0.5 * h * (one + two) + math.sqrt(3.0) / 12.0 * h * h * (two @ one - one @ two)) @ total
        return total


def _modes(order: float, period: float, tolerance: float) -> tuple[Floats, Floats, float]:
    """Return rates and weights of the kernel of I^p, and the integral of what is faster than them."""
    if order == 1.0:
        return np.zeros(1), np.ones(1), 0.0
    kernel = sum_of_exponentials(order, _SHORTEST * period, _LONGEST * period, tolerance)
    share = float((kernel.rates[-1] / kernel.rates[-2]) ** -order)
    rest = float(kernel.weights[-1] / kernel.rates[-1]) * share / (1.0 - share)
    return kernel.rates, kernel.weights, rest


def _refined(form: _ModeForm, tolerance: float) -> tuple[Complexes, int, float]:
    """Return the multipliers by descending magnitude, the steps that they took, and their last two changes' larger.

    One change alone says little of coefficients that jump: nodes may share the period out as they did before.
    """
    steps, changes, values = _STEPS, [np.inf, np.inf], _eigenvalues(form.monodromy(_STEPS))
    while max(changes) > tolerance and steps < _MOST_STEPS:
        steps, before = 2 * steps, values
        values = _eigenvalues(form.monodromy(steps))
        distances = np.abs(values[:, None] - before).min(axis=1)
        changes = [changes[-1], float(np.max(distances / np.maximum(1.0, np.abs(values))))]
    return values, steps, max(changes)


def _eigenvalues(matrix: Array) -> Complexes:
    values = np.linalg.eigvals(matrix).astype(np.complex128)
    return values[np.lexsort((-values.imag, -np.abs(values)))]
