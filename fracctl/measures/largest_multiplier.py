"""The largest Floquet multiplier of the orbit that delayed feedback leads to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Complexes, Floats
from fracctl.controllers.delayed_feedback import DelayedTerm, GainFunction
from fracctl.errors import ArgumentError
from fracctl.stability.floquet import FEWEST_NODES, Neighbourhood, nontrivial_multipliers, real_above_one
from fracctl.stability.periodic_orbits import shoot
from fracctl.stepwise import StepwiseTrajectory


class LargestMultiplier:
    """max |μ| over the non-trivial multipliers of the target orbit under the control of a run; below 1 it is stable.

    The target is the free orbit whose period is the delay, found by shooting from a guess. NaN where there is none.
    Of a run without control (K = 0) these are the multipliers of the free motion. Beside it stands how many of the
    target's own multipliers are real and above 1 (`fracctl.stability.real_above_one`): an odd number cannot be
    stabilised where the plant depends on time.

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
        """Return columns ``largest_multiplier`` and ``free_multipliers_above_one``, (b,)."""
        targets: dict[tuple[float, ...], _Target | None] = {}
        found = np.array([self._of(trajectory, i, targets) for i in range(len(trajectory.end))])
        return dict(zip(self.columns, found.T, strict=True))

    def _of(
        self, trajectory: StepwiseTrajectory, member: int, targets: dict[tuple[float, ...], _Target | None]
    ) -> tuple[float, float]:
        term = trajectory.terms[0]
        delay, recall = float(term.delay[member]), float(term.recall[member])
        if self.guess is None:
            last = delay * np.floor(trajectory.end / delay * (1.0 + 1e-12))[:, None]
            guess = trajectory.steps(last)[member, 0]
        else:
            guess = np.asarray(self.guess, dtype=np.float64)
        key = (delay, *guess.tolist())
        if key not in targets:
            targets[key] = _target(trajectory, guess, delay, self.nodes)
        target, gain = targets[key], _gain(term, trajectory, member)
        if target is None:
            return np.nan, np.nan
        values = target.free if gain is None else target.near.nontrivial(gain, recall)
        return float(np.abs(values[0])), float(real_above_one(target.free))


@dataclass(frozen=True)
class _Target:
    near: Neighbourhood
    free: Complexes
    """Non-trivial multipliers without control."""


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
