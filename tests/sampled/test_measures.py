"""Settling between samples, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import PD
from fracctl.errors import ArgumentError
from fracctl.plants import LinearPlant
from fracctl.sampled import SampledLaw, Window, delta_v, settling_times, simulate
from fracctl.sampled.trajectory import SampledTrajectory

DAMPED = LinearPlant(-1.01, -0.2)
"""ξ = e^{-t/10} cos t from ξ(0) = 1, ξ'(0) = -0.1."""


def flight(period: float, horizon: float = 60.0) -> SampledTrajectory:
    return simulate(DAMPED, SampledLaw(PD(0.0, 0.0), Window(2), period), [1.0, -0.1], horizon)


def test_settling_is_found_between_samples() -> None:
    times = np.linspace(0.0, 60.0, 6_000_001)
    exact = np.abs(np.exp(-0.1 * times) * np.cos(times))
    deltas = [0.5, 0.1, 0.02]
    expected = [times[np.flatnonzero(exact > delta)[-1]] for delta in deltas]
    np.testing.assert_allclose(settling_times(flight(0.1), deltas), expected, atol=3e-5)
    sampled = settling_times(flight(0.1), deltas, at_samples=True)
    np.testing.assert_allclose(sampled, np.floor(10.0 * np.array(expected)) / 10.0)


def test_a_peak_between_two_samples_counts() -> None:
    """|ξ| is largest at the turn near t = 3.04; samples at 2.8 and 3.3 are both lower."""
    top = np.exp(-0.1 * (np.pi - np.arctan(0.1))) * np.cos(np.arctan(0.1))
    coarse = flight(0.55)
    assert np.abs(coarse.states[5:7, 0]).max() < top - 2e-3
    assert 2.75 < settling_times(coarse, [top - 1e-3])[0] < 3.3
    assert settling_times(coarse, [top - 1e-3], at_samples=True)[0] == 0.55


def test_never_and_always_outside() -> None:
    found = settling_times(flight(0.1, 5.0), [2.0, 1e-3])
    assert found.tolist() == [0.0, np.inf]


def test_refusals() -> None:
    with pytest.raises(ArgumentError, match="`thresholds`"):
        settling_times(flight(0.1, 1.0), [0.0])
    with pytest.raises(ArgumentError, match="`by`"):
        delta_v(flight(0.1, 1.0), by="sum")
