"""Orbits about Eros (ρ = 1.9) under delayed feedback: the problem of one benchmark, and its truth.

The truth is SciPy's DOP853, one delay after the other, each on the dense output of the one before.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fracctl.plants import RotatingEllipsoid

Floats = NDArray[np.float64]

RHO, DELAY, ORBITS = 1.9, 3.10656, 20
GAINS = np.array([0.0525, -0.1243, 0.1169, 0.0373])
"""(a, b, c, d) of K = [aI + bJ | cI + dJ], J = [[0, 1], [-1, 0]]."""
START = np.array([0.0, 1.0, RHO, 0.0])
PLANT = RotatingEllipsoid()


def gains(count: int) -> Floats:
    """Return gains within 2 % of the middle, the middle first, (count, 4)."""
    spread = 1.0 + 0.02 * np.random.default_rng(1).uniform(-1.0, 1.0, (count, 4))
    spread[0] = 1.0
    return GAINS * spread


def matrices(rows: Floats) -> Floats:
    """Return K of gains (r, 4), (r, 2, 4)."""
    a, b, c, d = rows.T
    return np.stack([np.stack([a, b, c, d], axis=1), np.stack([-b, a, -d, c], axis=1)], axis=1)


def free_rates(time: float, state: Floats) -> Floats:
    """Return x' of the free motion, (4,)."""
    return PLANT.rates(np.array([time]), state[None], np.zeros((1, 2)))[0]


@cache
def free_motion() -> Callable[[float], Floats]:
    """Return the free motion on [0, DELAY]."""
    return _dense(free_rates, 0.0, START)


def truth(row: Floats) -> Floats:
    """Return the states at the ends of the controlled orbits for gains (4,), (ORBITS, 4)."""
    (gain,), past, states = matrices(row[None]), free_motion(), []
    state = past(DELAY)
    for k in range(1, ORBITS + 1):
        past = _dense(partial(_controlled, gain, past), k * DELAY, state)
        state = past((k + 1) * DELAY)
        states.append(state)
    return np.array(states)


def _controlled(gain: Floats, past: Callable[[float], Floats], time: float, state: Floats) -> Floats:
    control = -gain @ (state - past(time - DELAY))
    return PLANT.rates(np.array([time]), state[None], control[None])[0]


def _dense(rates: Callable[[float, Floats], Floats], start: float, state: Floats) -> Callable[[float], Floats]:
    span = (start, start + DELAY)
    return solve_ivp(rates, span, state, "DOP853", rtol=1e-13, atol=1e-14, dense_output=True).sol
