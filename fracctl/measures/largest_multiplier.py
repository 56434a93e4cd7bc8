"""The largest Floquet multiplier of the orbit that delayed feedback leads to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fracctl.arrays import Floats
from fracctl.controllers.delayed_feedback import DelayedTerm, GainFunction
from fracctl.errors import ArgumentError
from fracctl.stability.floquet import FEWEST_NODES, Neighbourhood, nontrivial_multipliers
from fracctl.stability.periodic_orbits import PeriodicOrbit, shoot
from fracctl.stepwise import StepwiseTrajectory


class LargestMultiplier:
    """max |μ| over the non-trivial multipliers of the target orbit under the control of a run; below 1 it is stable.

    The target is the free orbit whose period is the delay, found by shooting from a guess. NaN where there is none.
    Of a run without control (K = 0) these are the multipliers of the free motion.

    Args:
        guess: a state at time 0 near the target, (n,); None for the state after the last whole number of delays.
        nodes: Chebyshev nodes in a delay.

    Raises:
        ArgumentError: there are too few nodes.
    """

    name = "largest_multiplier"
    columns = ("largest_multiplier",)

    def __init__(self, guess: Sequence[float] | None = None, nodes: int = 60) -> None:
        if nodes < FEWEST_NODES:
            raise ArgumentError("nodes", nodes, f"must be at least {FEWEST_NODES}")
        self.guess, self.nodes = guess, nodes

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return column ``largest_multiplier``, (b,)."""
        orbits: dict[tuple[float, ...], Neighbourhood | None] = {}
        found = [self._of(trajectory, i, orbits) for i in range(len(trajectory.end))]
        return {self.name: np.array(found)}

    def _of(
        self, trajectory: StepwiseTrajectory, member: int, orbits: dict[tuple[float, ...], Neighbourhood | None]
    ) -> float:
        term = trajectory.terms[0]
        delay, recall = float(term.delay[member]), float(term.recall[member])
        if self.guess is None:
            last = delay * np.floor(trajectory.end / delay * (1.0 + 1e-12))[:, None]
            guess = trajectory.steps(last)[member, 0]
        else:
            guess = np.asarray(self.guess, dtype=np.float64)
        key = (delay, *guess.tolist())
        if key not in orbits:
            orbit = _orbit(trajectory, guess, delay)
            orbits[key] = None if orbit is None else Neighbourhood(orbit, self.nodes)
        near, gain = orbits[key], _gain(term, trajectory, member)
        if near is None:
            return np.nan
        values = nontrivial_multipliers(near.orbit) if gain is None else near.nontrivial(gain, recall)
        return float(np.abs(values[0]))


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


def _orbit(trajectory: StepwiseTrajectory, guess: Floats, period: float) -> PeriodicOrbit | None:
    if not np.isfinite(guess).all():
        return None
    try:
        return shoot(trajectory.plant, guess, period)
    except ArgumentError:
        return None
