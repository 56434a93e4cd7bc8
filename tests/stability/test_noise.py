"""The noise gain: limits in closed form, and quadrature by another package."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import fracctl as fc
from fracctl.controllers import PD, PDAlpha, PDLag
from fracctl.errors import ArgumentError
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from fracctl.stability import noise_gain


def test_by_quadrature() -> None:
    k_p, k_d, alpha, period = 0.85, 2.0, 0.91, 0.05

    def power(omega: float) -> float:
        control, plant = k_p + k_d * (1j * omega) ** alpha, 1.0 - omega**2
        return float(abs(control * plant / (plant + control)) ** 2)

    nyquist = np.pi / period
    expected = quad(power, 0.0, nyquist, limit=500, epsabs=0.0, epsrel=1e-11)[0]
    found = noise_gain(fc.ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, alpha)), period)
    assert found == pytest.approx(np.sqrt(expected / nyquist), rel=1e-8)


def test_limits_of_fast_sampling() -> None:
    """k_D ω_N/√3 of PD, k_D ω_N^α/√(2α + 1) of PD^α, k_P + k_D/T_f with a lag."""
    period = 1e-5
    nyquist = np.pi / period
    laws = (PD(0.55, 2.0), PDAlpha(0.85, 2.0, 0.91), PDLag(1.3, 2.0, 0.2))
    expected = (2.0 * nyquist / np.sqrt(3.0), 2.0 * nyquist**0.91 / np.sqrt(2.82), 1.3 + 2.0 / 0.2)
    for law, value in zip(laws, expected, strict=True):
        assert noise_gain(fc.ClosedLoop(HCWOutOfPlane(), law), period) == pytest.approx(value, rel=2e-4)


def test_a_lag_takes_the_noise_away() -> None:
    """At 5 s a hundred times less than PD, at 10 s half as much less: PD's grows with the rate of sampling."""
    pd, lag = (fc.ClosedLoop(HCWOutOfPlane(), law) for law in (PD(0.55, 2.0), PDLag(1.3, 2.0, 0.2)))
    assert noise_gain(pd) / noise_gain(lag) == pytest.approx(51.0, abs=1.0)
    assert noise_gain(pd, 3.157e-3) / noise_gain(lag, 3.157e-3) == pytest.approx(102.0, abs=2.0)


def test_two_controls_that_are_not_coupled() -> None:
    """PDD-like gains that cancel the coupling leave two loops u'' = -k u - c u'; their powers add up."""
    damping = np.array([[0.0, 2.0], [-2.0, 0.0]])
    loop = fc.ClosedLoop(HCWInPlane(), PD(np.diag([4.0, 1.0]), np.eye(2) + damping))
    nyquist = np.pi / 0.05

    def power(omega: float) -> float:
        s = 1j * omega
        closed = np.diag([s**2 + s + 1.0, s**2 + s + 1.0])
        control = np.diag([4.0, 1.0]) + s * (np.eye(2) + damping)
        plant = s**2 * np.eye(2) - s * damping - np.diag([3.0, 0.0])
        return float(np.linalg.norm(control @ np.linalg.inv(closed) @ plant) ** 2)

    expected = np.sqrt(quad(power, 0.0, nyquist, limit=500)[0] / nyquist)
    assert noise_gain(loop, 0.05) == pytest.approx(expected, rel=1e-8)


def test_batches_and_refusals() -> None:
    found = noise_gain(fc.ClosedLoop(HCWOutOfPlane(), PD([0.55, 0.55], [2.0, -2.0])))
    assert np.isfinite(found[0])
    assert np.isnan(found[1])
    with pytest.raises(ArgumentError, match="sample_period"):
        noise_gain(fc.ClosedLoop(HCWOutOfPlane(), PD(0.55, 2.0)), 0.0)
