"""What a memory knows at switch-on: measurements of the free drift before it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.plants import PerturbedRelativeMotion
from fracctl.plants.state import StatePlant
from fracctl.sampled import Navigation
from fracctl.sampled.propagation import LONGEST_STEP, advance_by

_STREAM = int.from_bytes(b"before")
"""Added to the seed of a flight's noise for that of its history."""


def check(orbits: float, truth: object) -> None:
    """Raise ArgumentError unless there is motion before time 0 to be recorded."""
    if orbits and isinstance(truth, PerturbedRelativeMotion):
        allowed = "needs motion before switch-on, which perturbed_relative_motion has from time 0 on"
        raise ArgumentError("history_orbits", orbits, allowed, "take truth.type=relative_motion, or 0")


def recorded(
    plant: StatePlant,
    states: Floats,
    navigation: Navigation | None,
    period: float,
    orbits: float,
    seed: int,
    numbers: Sequence[int],
) -> Floats | None:
    """Return measurements [ξ, ξ'] of the free motion that ends at the states, one a period up to -T_s, (b, k, 2m).

    Args:
        plant: that moves without control.
        states: at time 0, (b, n).
        navigation: what is measured; None for the true state. As in a flight, measurements may be held.
        period: T_s.
        orbits: how long, in 2π; None is returned for none.
        seed: of the flight's noise.
        numbers: of the members, (b,).
    """
    count = round(2.0 * math.pi * orbits / period)
    if not count:
        return None
    parts = math.ceil(period / LONGEST_STEP)
    back = advance_by(plant, -period / parts)
    idle: Any = np.zeros((len(states), plant.n_controls))
    x, before = states, np.empty((count, *states.shape))
    for k in range(count):
        for part in range(parts):
            x = back(-(k + part / parts) * period, x, idle)
        before[count - 1 - k] = x
    told = navigation or Navigation()
    errors = told.errors(seed + _STREAM, numbers, plant.n_controls, -(-count // told.every))
    for k in range(0, count, told.every):
        before[k : k + told.every] = before[k] + next(errors)
    return np.ascontiguousarray(np.swapaxes(before, 0, 1))
