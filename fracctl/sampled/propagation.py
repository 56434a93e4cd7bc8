"""Plants between the instants at which their controls change."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.linalg import expm

from fracctl.arrays import Floats
from fracctl.compiling import compiled_with
from fracctl.plants.linear import LinearPlant
from fracctl.plants.state import StatePlant
from fracctl.solvers import dop853

Advance = Callable[[float, Floats, Floats], Floats]
"""Takes the time, states (b, n) and controls (b, m) that stay, and returns the states later."""
LONGEST_STEP = 0.05
"""Of DOP853, in the plant's unit of time: 1/125 of an orbit."""


def held(plant: LinearPlant, duration: float) -> tuple[Floats, Floats]:
    """Return Φ (n, n) and Γ (n, m) with x(t + duration) = Φ x(t) + Γ u for a control that stays."""
    m, n = plant.n_controls, plant.n_states
    block = np.zeros((n + m, n + m))
    block[:m, m:n], block[m:n, n:] = np.eye(m), np.eye(m)
    block[m:n, :m], block[m:n, m:n] = plant.stiffness, plant.damping
    whole = expm(block * duration)
    return whole[:n, :n], whole[:n, n:]


def advance_by(plant: StatePlant, duration: float) -> Advance:
    """Return what takes states on by a duration: exactly for a linear plant, otherwise by steps of DOP853."""
    if isinstance(plant, LinearPlant):
        transition, input_matrix = held(plant, duration)
        return lambda _, x, u: _linear(x, transition, u, input_matrix)
    count = max(1, math.ceil(duration / LONGEST_STEP))
    width = duration / count

    def advance(time: float, x: Floats, u: Floats) -> Floats:
        for i in range(count):
            x = _step(plant, time + i * width, width, x, u)
        return x

    return advance


def _linear(x: Floats, transition: Floats, u: Floats, input_matrix: Floats) -> Floats:
    """Return x Φᵀ + u Γᵀ, whose rows do not depend on how many there are."""
    out: Floats = (x[:, None, :] * transition).sum(axis=2) + (u[:, None, :] * input_matrix).sum(axis=2)
    return out


def _step(plant: StatePlant, time: float, width: float, x: Floats, u: Floats) -> Floats:
    slopes = np.empty((dop853.END, *x.shape))
    at, place = np.empty(len(x)), np.empty_like(x)
    for s in range(dop853.END):
        at[:] = time + dop853.NODES[s] * width
        _combine(dop853.COMBINE[s, 1:], s, width, x, slopes, place)
        slopes[s] = plant.rates(at, place, u)
    out = np.empty_like(x)
    _combine(dop853.COMBINE[dop853.END, 1:], dop853.END, width, x, slopes, out)
    return out


@compiled_with(error_model="numpy")
def _combine(weights: Floats, stages: int, width: float, x: Floats, slopes: Floats, out: Floats) -> None:
    """Write x + h Σ_{j < stages} w_j k_j."""
    for i in range(x.shape[0]):
        for n in range(x.shape[1]):
            total = 0.0
            for j in range(stages):
                if weights[j] != 0.0:
                    total += weights[j] * slopes[j, i, n]
            out[i, n] = x[i, n] + width * total
