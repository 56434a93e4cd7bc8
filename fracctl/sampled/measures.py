"""Measures of sampled flights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fracctl.arrays import Booleans, Floats
from fracctl.errors import ArgumentError
from fracctl.sampled.trajectory import SampledTrajectory, cubic

_HALVINGS = 50


def settling_times(trajectory: SampledTrajectory, thresholds: Sequence[float], *, at_samples: bool = False) -> Floats:
    """Return the last time with |ξ_i| = δ in any component for each δ, (b, d), or (d,) for a single flight.

    On Hermite's cubics between samples; or the last sample with |ξ_i| > δ. +inf where the flight ends outside or has
    diverged, 0 where it never is.

    Args:
        trajectory: of a flight.
        thresholds: δ > 0, dimensionless, (d,).
        at_samples: look at the samples alone.

    Raises:
        ArgumentError: a δ is not positive.
    """
    deltas = np.asarray(thresholds, dtype=np.float64)
    if deltas.ndim != 1 or not (deltas > 0.0).all():
        raise ArgumentError("thresholds", deltas.tolist(), "must be a list of positive numbers")
    m = trajectory.commands.shape[2]
    size = np.abs(trajectory.at_samples[..., :m]).max(axis=2)
    ended = ~(size[:, -1:] <= deltas)
    if at_samples:
        found = np.stack([_last(size > delta) for delta in deltas], axis=1) * trajectory.period
    else:
        highest = _highest(trajectory).max(axis=2)
        found = np.stack([_last_crossing(trajectory, highest, delta) for delta in deltas], axis=1)
    out = np.where(ended, np.inf, np.maximum(found, 0.0))
    return out if trajectory.batched else out[0]


def delta_v(trajectory: SampledTrajectory, *, by: str = "axis") -> Floats | float:
    """Return ∫ Σ_i |u_i| dt (``axis``) or ∫ |u| dt (``norm``) up to the horizon, exactly, (b,) or a number."""
    if by not in ("axis", "norm"):
        raise ArgumentError("by", repr(by), "must be 'axis' or 'norm'")
    order = 1 if by == "axis" else 2
    size = np.linalg.norm(trajectory.commands, order, axis=2)
    durations = np.clip(size.shape[1] - np.arange(size.shape[1]) - trajectory.delay, 0.0, 1.0) * trajectory.period
    found = np.where(trajectory.status == "ok", (size * durations).sum(axis=1), np.nan)
    return found if trajectory.batched else float(found[0])


def peak_control(trajectory: SampledTrajectory) -> Floats | float:
    """Return the largest |u|, (b,) or a number."""
    found = np.linalg.norm(trajectory.commands, axis=2).max(axis=1)
    return found if trajectory.batched else float(found[0])


def final_rms(trajectory: SampledTrajectory, duration: float) -> tuple[Floats, Floats]:
    """Return the rms of each position and of each control over the last `duration`, (b, m) or (m,) each."""
    m = trajectory.commands.shape[2]
    count = max(1, min(round(duration / trajectory.period), trajectory.commands.shape[1]))
    last = (trajectory.at_samples[:, -count:, :m], trajectory.commands[:, -count:])
    position, control = (np.sqrt((values**2).mean(axis=1)) for values in last)
    return (position, control) if trajectory.batched else (position[0], control[0])


def _last(outside: Booleans) -> Floats:
    """Return the last place where a row is True, -1 where none is."""
    found = outside.shape[1] - 1 - outside[:, ::-1].argmax(axis=1)
    return np.where(outside.any(axis=1), found, -1).astype(np.float64)


def _highest(trajectory: SampledTrajectory) -> Floats:
    """Return the largest |ξ_i| of every period on its cubic, (b, K, m)."""
    count = trajectory.commands.shape[1]
    coefficients = trajectory.cubics(np.arange(count))
    _, c1, c2, c3 = coefficients
    highest = np.maximum(np.abs(cubic(coefficients, np.zeros(1))), np.abs(cubic(coefficients, np.ones(1))))
    with np.errstate(all="ignore"):
        root = np.sqrt(c2**2 - 3.0 * c1 * c3)
        scaled = -c2 - np.copysign(root, c2)
        for turn in (scaled / (3.0 * c3), c1 / scaled):
            inside = (turn > 0.0) & (turn < 1.0)
            value = np.abs(cubic(coefficients, np.where(inside, turn, 0.0)))
            highest = np.where(inside, np.maximum(highest, value), highest)
    return highest


def _last_crossing(trajectory: SampledTrajectory, highest: Floats, delta: float) -> Floats:
    """Return the last time with |ξ_i| = δ; -1 where there is none. What ends outside is wrong."""
    period_of = _last(highest > delta)
    rows = np.flatnonzero(period_of >= 0.0)
    found = np.full(len(highest), -1.0)
    if not rows.size:
        return found
    k = period_of[rows].astype(int)
    coefficients = trajectory.cubics(k)[:, rows, np.arange(rows.size)]
    shares = 1.0 - np.arange(_SCAN + 1) / _SCAN
    values = np.abs(cubic(coefficients[:, :, None], shares[:, None])).max(axis=2)
    first = (values > delta).argmax(axis=1)
    upper = shares[np.maximum(first - 1, 0)]
    lower = np.where((values > delta).any(axis=1), shares[first], upper)
    for _ in range(_HALVINGS):
        middle = 0.5 * (lower + upper)
        outside = np.abs(cubic(coefficients, middle[:, None])).max(axis=1) > delta
        lower, upper = np.where(outside, middle, lower), np.where(outside, upper, middle)
    found[rows] = (k + upper) * trajectory.period
    return found


_SCAN = 16
"""Parts of a period in which the last place outside is looked for."""
