"""The largest Lyapunov exponent of a free plant, from the distance between neighbouring motions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite, positive
from fracctl.errors import ArgumentError
from fracctl.plants.state import StatePlant
from fracctl.solvers.members import whole
from fracctl.solvers.method_of_steps.mesh import Mesh
from fracctl.solvers.method_of_steps.runs import run

_DISTANCE = 1e-7
"""Between neighbours, over 1 + |x|: curvature changes its growth by as much, rounding by 1e-9."""


def largest_exponent(
    plant: StatePlant,
    initial_state: ArrayLike,
    horizon: float,
    transient: float = 0.0,
    interval: float = 2.0 * np.pi,
    steps: int = 40,
) -> Floats | float:
    """Return the mean rate at which a neighbouring motion departs, (b,), or a number for a single motion.

        λ = 1/(S - S₀) Σ_i ln(d_i / d₀)

    After each interval the neighbour, at the distance d_i, is moved along the line to the motion back to the distance
    d₀; growth before the transient S₀ has ended does not count. Of motions on one attractor, members of a batch, the
    mean is the better estimate; where multipliers are complex or motion is chaotic it converges as 1/S or 1/√S. NaN
    where a motion stops being finite. (Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980) 9.)

    Args:
        plant: without control.
        initial_state: x(0), (n,), or (b, n) one a member.
        horizon: S, rounded up to whole intervals.
        transient: S₀ ≥ 0, rounded up to whole intervals.
        interval: of time between two corrections; neighbours must stay near one another in it.
        steps: of the method of steps in 2π of time.

    Raises:
        ArgumentError: a shape does not fit, a number is out of its range, or nothing is left after the transient.
    """
    given, n = finite("initial_state", initial_state), plant.n_states
    if given.ndim not in (1, 2) or given.shape[-1] != n:
        raise ArgumentError("initial_state", f"of shape {given.shape}", f"must have shape ({n},) or (b, {n})")
    length = positive("interval", interval)
    count = int(np.ceil(positive("horizon", horizon) / length * (1.0 - 1e-12)))
    skipped = int(np.ceil(float(finite("transient", transient)) / length * (1.0 - 1e-12)))
    if not 0 <= skipped < count:
        raise ArgumentError("transient", transient, f"must lie in [0, {horizon:g}), before the horizon")
    states = np.atleast_2d(given)
    b, width = len(states), max(1, int(np.ceil(whole("steps", steps, 8, 100_000) * length / (2.0 * np.pi))))
    offset = np.ones(states.shape) / np.sqrt(n)
    growth: Floats = np.zeros(b)
    with np.errstate(all="ignore"):
        for i in range(count):
            distance = _DISTANCE * (1.0 + np.linalg.norm(states, axis=1, keepdims=True))
            both = _flowed(plant, np.concatenate([states, states + distance * offset]), i * length, length, width)
            states, apart = both[:b], both[b:] - both[:b]
            size = np.linalg.norm(apart, axis=1, keepdims=True)
            offset = apart / size
            if i >= skipped:
                growth += np.log(size / distance)[:, 0]
    rate = growth / ((count - skipped) * length)
    return rate if given.ndim == 2 else float(rate[0])


def _flowed(plant: StatePlant, start: Floats, time: float, length: float, count: int) -> Floats:
    """Return the states (b, n) after some steps from a time on."""
    edges = np.tile(np.linspace(time, time + length, count + 1), (len(start), 1))
    steps = run(plant, (), None, None, Mesh(edges, None, None), np.ascontiguousarray(start), lambda *_: False)
    return steps(edges[:, -1:])[:, 0]
