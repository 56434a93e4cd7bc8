"""ΔV: the integral of the magnitude of the control vector."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite
from fracctl.errors import ArgumentError
from fracctl.stepwise import StepwiseTrajectory

_GAUSS = 5
"""Points a step; exact for polynomials of degree nine."""


def delta_v(trajectory: StepwiseTrajectory, start: ArrayLike = 0.0, stop: ArrayLike | None = None) -> Floats | float:
    """Return ∫ |u| dt from `start` to `stop` by Gauss's rule on the steps, (b,), or a number for a single loop.

    Free motion before switch-on costs nothing. Times the speed scale of the plant it is in m/s. Where |u| has a kink,
    for u = 0, the error is of the order of the step squared.

    Args:
        trajectory: of the method of steps; behind the end of a member nothing is added.
        start: (), or (b,) for each member its own.
        stop: shaped as `start`; None for the horizon.

    Raises:
        ArgumentError: an interval does not lie in [0, horizon].
    """
    first, last = finite("start", start), finite("stop", trajectory.horizon if stop is None else stop)
    for name, value in (("start", first), ("stop", last)):
        if value.size and not (value.min() >= 0.0 and value.max() <= trajectory.horizon * (1.0 + 1e-12)):
            raise ArgumentError(name, value.tolist(), f"must lie in [0, {trajectory.horizon:g}], the solved horizon")
    end = np.minimum(trajectory.end, last)[:, None]
    edges = np.clip(trajectory.steps.edges, np.minimum(np.reshape(first, (-1, 1)), end), end)
    points, weights = np.polynomial.legendre.leggauss(_GAUSS)
    half = 0.5 * np.diff(edges, axis=1)[..., None]
    times = np.minimum(edges[:, :-1, None] + half * (1.0 + points), end[..., None])
    controls = np.atleast_3d(trajectory.control(times.reshape(len(edges), -1)).T).T
    speed = np.linalg.norm(controls, axis=2).reshape(times.shape)
    total: Floats = (speed * weights * half).sum(axis=(1, 2))
    return total if trajectory.batched else float(total[0])
