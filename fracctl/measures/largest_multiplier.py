"""The largest Floquet multiplier of the orbit that delayed feedback leads to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Complexes, Floats
from fracctl.controllers.delayed_feedback import DelayedTerm, GainFunction
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.measures.base import OfTrajectories
from fracctl.measures.periods import periods
from fracctl.stability.floquet import FEWEST_NODES, Neighbourhood, nontrivial_multipliers, real_above_one
from fracctl.stability.periodic_orbits import shoot
from fracctl.stepwise import StepwiseTrajectory


class LargestMultiplier(OfTrajectories):
    """max |μ| over the non-trivial multipliers of the target orbit under the control of a run; below 1 it is stable.

    The target is the free orbit whose period is the last delay, found by shooting from a guess. NaN where there is
    none. Of a run without control (K = 0) these are the multipliers of the free motion. Beside it stands how many of
    the target's own multipliers are real and above 1 (`fracctl.stability.real_above_one`): an odd number cannot be
    stabilised where the plant depends on time. The terms of a sum act together, with one delay and one recall.

    Args:
        guess: a state at time 0 near the target, (n,); None for the state after the last whole number of delays.
        nodes: Chebyshev nodes in a delay.

    Raises:
        ArgumentError: there are too few nodes.
    """

    name = "largest_multiplier"
    columns = ("largest_multiplier", "free_multipliers_above_one")

    def __init__(self, guess: Sequence[float] | None = None, nodes: int = 60) -> None:
        if nodes < FEWEST_NODES:
            raise ArgumentError("nodes", nodes, f"must be at least {FEWEST_NODES}")
        self.guess, self.nodes = guess, nodes

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return columns ``largest_multiplier`` and ``free_multipliers_above_one``, (b,).

        Raises:
            UnsupportedError: the terms of the control differ in delay or recall.
        """
        first = trajectory.terms[:1]
        if any(not _alike(term, one) for one in first for term in trajectory.terms[1:]):
            raise UnsupportedError(
                "the largest multiplier is that of one delay with one recall, but the control is a sum with several;"
                " leave the measure out, or take laws of one delay"
            )
        delays = periods(trajectory, None)
        guesses = self._guesses(trajectory, delays)
        targets: dict[tuple[float, ...], _Target | None] = {}
        found = []
        for member, (delay, guess) in enumerate(zip(delays.tolist(), guesses, strict=True)):
            key = (delay, *guess.tolist())
            if key not in targets:
                targets[key] = _target(trajectory, guess, delay, self.nodes)
            found.append(_of(targets[key], trajectory, member))
        return dict(zip(self.columns, np.array(found).T, strict=True))

    def _guesses(self, trajectory: StepwiseTrajectory, delays: Floats) -> Floats:
        """Return a state near the target of each member, (b, n)."""
        if self.guess is not None:
            return np.tile(np.asarray(self.guess, dtype=np.float64), (len(delays), 1))
        last = delays * np.floor(trajectory.end / delays * (1.0 + 1e-12))
        return trajectory.steps(last[:, None])[:, 0]


@dataclass(frozen=True)
class _Target:
    near: Neighbourhood
    free: Complexes
    """Non-trivial multipliers without control."""


def _of(target: _Target | None, trajectory: StepwiseTrajectory, member: int) -> tuple[float, float]:
    if target is None:
        return np.nan, np.nan
    parts = [part for term in trajectory.terms if (part := _gain(term, trajectory, member)) is not None]
    values = (
        target.near.nontrivial(_together(parts), float(trajectory.terms[0].recall[member])) if parts else target.free
    )
    return float(np.abs(values[0])), float(real_above_one(target.free))


def _alike(one: DelayedTerm, other: DelayedTerm) -> bool:
    return np.array_equal(one.delay, other.delay) and np.array_equal(one.recall, other.recall)


def _together(parts: list[Floats | GainFunction]) -> Floats | GainFunction:
    """Return the sum of gains and gain functions."""
    if len(parts) == 1:
        return parts[0]
    functions = [part for part in parts if callable(part)]
    constant: Floats = np.sum([part for part in parts if not callable(part)], axis=0)
    if not functions:
        return constant
    return lambda times: constant + sum(function(times) for function in functions)


def _gain(term: DelayedTerm, trajectory: StepwiseTrajectory, member: int) -> Floats | GainFunction | None:
    """Return K of a member, or K(t) over its last whole delay; None for free motion."""
    if term.schedule is None:
        gain: Floats = term.gain[member]
        return gain if gain.any() else None
    schedule, batch = term.schedule, len(trajectory.end)
    start = term.delay * (np.floor(trajectory.end / term.delay * (1.0 + 1e-12)) - 1.0)
    if not schedule(start[:, None])[member].any():
        return None
    return lambda times: schedule(start[:, None] + np.broadcast_to(times, (batch, times.shape[1])))[member, None]


def _target(trajectory: StepwiseTrajectory, guess: Floats, period: float, nodes: int) -> _Target | None:
    if not np.isfinite(guess).all():
        return None
    try:
        orbit = shoot(trajectory.plant, guess, period)
    except ArgumentError:
        return None
    return _Target(Neighbourhood(orbit, nodes), nontrivial_multipliers(orbit))
