"""ΔV: the integral of the magnitude of the control vector."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Booleans, Floats, finite
from fracctl.errors import ArgumentError
from fracctl.measures.base import check_kind
from fracctl.stepwise import StepwiseTrajectory

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
"""Exact for polynomials of degree nine."""
_SAMPLES: Floats = np.concatenate([[-1.0], _POINTS, [1.0]])
"""Where in a step a kink is looked for between neighbours; of two between the same ones neither is seen."""
_HALVINGS = 48


def delta_v(trajectory: StepwiseTrajectory, start: ArrayLike = 0.0, stop: ArrayLike | None = None) -> Floats | float:
    """Return ∫ |u| dt from `start` to `stop` by Gauss's rule on the steps, (b,), or a number for a single loop.

    Free motion before switch-on costs nothing. Times the speed scale of the plant it is in m/s. Steps are cut where a
    component changes its sign or a saturation sets in, so that kinks of |u| do not matter: the rule errs by less than
    1e-9 of the whole with 40 steps to a smooth orbit or more. Two kinks of one kind within a quarter of a step are
    missed, at the cost of the square of their distance.

    Args:
        trajectory: of the method of steps; behind the end of a member nothing is added.
        start: (), or (b,) for each member its own.
        stop: shaped as `start`; None for the horizon.

    Raises:
        ArgumentError: an interval does not lie in [0, horizon].
        UnsupportedError: the trajectory is another.
    """
    check_kind("delta_v", "StepwiseTrajectory", trajectory)
    first, last = finite("start", start), finite("stop", trajectory.horizon if stop is None else stop)
    for name, value in (("start", first), ("stop", last)):
        if value.size and not (value.min() >= 0.0 and value.max() <= trajectory.horizon * (1.0 + 1e-12)):
            raise ArgumentError(name, value.tolist(), f"must lie in [0, {trajectory.horizon:g}], the solved horizon")
    end = np.minimum(trajectory.end, last)[:, None]
    edges = np.clip(trajectory.steps.edges, np.minimum(np.reshape(first, (-1, 1)), end), end)
    total: Floats = _over(trajectory, edges[:, :-1], edges[:, 1:]).sum(axis=1)
    return total if trajectory.batched else float(total[0])


def _over(trajectory: StepwiseTrajectory, low: Floats, high: Floats) -> Floats:
    """Return ∫ |u| dt over intervals (b, k), (b, k)."""
    spent = _smooth(trajectory, low, high)
    times = _inside(low, high, _SAMPLES)
    kinks = _kinks(trajectory, times)
    turned = _turns(kinks).any(axis=(2, 3))
    most = int(turned.sum(axis=1).max(initial=0))
    if not most:
        return spent
    which = np.argsort(~turned, axis=1, kind="stable")[:, :most]
    chosen = np.take_along_axis(turned, which, axis=1)
    cuts = _cut(trajectory, np.take_along_axis(times, which[..., None], axis=1))
    parts = _smooth(trajectory, *(c.reshape(len(cuts), -1) for c in (cuts[..., :-1], cuts[..., 1:])))
    parts = parts.reshape(*which.shape, -1).sum(axis=2)
    np.put_along_axis(spent, which, np.where(chosen, parts, np.take_along_axis(spent, which, axis=1)), axis=1)
    return spent


def _smooth(trajectory: StepwiseTrajectory, low: Floats, high: Floats) -> Floats:
    """Return ∫ |u| dt over intervals (b, k) without kinks, (b, k)."""
    size = np.linalg.norm(_asked(trajectory.control, trajectory, _inside(low, high, _POINTS)), axis=-1)
    spent: Floats = 0.5 * (high - low) * (size @ _WEIGHTS)
    return spent


def _cut(trajectory: StepwiseTrajectory, times: Floats) -> Floats:
    """Return the samples of steps (b, f, k) with the kinks between them, in order, (b, f, …)."""
    kinks = _kinks(trajectory, times)
    turns, cuts = _turns(kinks), [times]
    for i in range(kinks.shape[-1]):
        low, high = times[..., :-1], times[..., 1:]
        before = kinks[..., :-1, i] < 0.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            same = (_kinks(trajectory, middle)[..., i] < 0.0) == before
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        cuts.append(np.where(turns[..., i], high, times[..., 1:]))
    return np.sort(np.concatenate(cuts, axis=-1), axis=-1)


def _kinks(trajectory: StepwiseTrajectory, times: Floats) -> Floats:
    """Return at times (b, …) functions that change their signs where |u| has kinks, (b, …, g)."""
    demand = _asked(trajectory.demand, trajectory, times)
    if trajectory.saturation is None:
        return demand
    return np.concatenate([demand, trajectory.saturation.excess(demand)], axis=-1)


def _turns(kinks: Floats) -> Booleans:
    below = kinks < 0.0
    return np.not_equal(below[..., 1:, :], below[..., :-1, :])


def _inside(low: Floats, high: Floats, places: Floats) -> Floats:
    """Return the times at places in [-1, 1] of intervals (b, k), (b, k, p)."""
    times = low[..., None] + 0.5 * (high - low)[..., None] * (1.0 + places)
    return np.minimum(times, high[..., None])


def _asked(function: Callable[[Floats], Floats], trajectory: StepwiseTrajectory, times: Floats) -> Floats:
    """Return controls at times (b, …), (b, …, m)."""
    values = function(times.reshape(len(times), -1))
    return values.reshape(*times.shape, trajectory.plant.n_controls)
