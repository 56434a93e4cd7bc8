"""The largest Lyapunov exponent against closed forms, multipliers, and values of the libration."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.errors import ArgumentError
from fracctl.plants import FunctionPlant, Libration
from fracctl.stability import largest_exponent, multipliers, shoot

TURN = 2.0 * np.pi


def test_linear_plants() -> None:
    """The mean of a(t) for x' = a(t) x; the largest real part of eigenvalues; -0.4 beside 0.3 needs a transient."""
    swinging = FunctionPlant(lambda t, x, u: (0.3 + np.cos(t))[:, None] * x, 1, 1)
    assert largest_exponent(swinging, [0.0], 10.0 * TURN) == pytest.approx(0.3, abs=1e-9)
    assert largest_exponent(swinging, [0.0], 8.0, interval=1.0) == pytest.approx(0.3 + np.sin(8.0) / 8.0, abs=1e-9)
    matrix = np.array([[-0.4, 1.0], [0.0, 0.3]])
    plant = FunctionPlant(lambda t, x, u: x @ matrix.T, 2, 1)
    values = largest_exponent(plant, np.zeros((2, 2)), 20.0 * TURN, 10.0 * TURN)
    np.testing.assert_allclose(values, [0.3, 0.3], atol=1e-9)


def test_along_periodic_orbits_it_is_the_logarithm_of_the_largest_multiplier() -> None:
    """Of an unstable orbit at e = 0.2 and of the attracting one of period 4π at e = 0.14, where it is -0.026."""
    saddle = shoot(Libration(), [-0.28, -1.07], TURN)
    value = largest_exponent(Libration(), saddle.state, 8.0 * TURN, 4.0 * TURN, steps=100)
    assert value == pytest.approx(np.log(abs(multipliers(saddle)[0])) / TURN, abs=1e-4)
    plant = Libration(0.14)
    attractor = shoot(plant, [-0.3066, -1.0882], 2.0 * TURN)
    value = largest_exponent(plant, attractor.state, 640.0 * TURN, 40.0 * TURN, steps=16)
    assert value == pytest.approx(np.log(abs(multipliers(attractor)[0])) / (2.0 * TURN), abs=1e-3)
    assert value == pytest.approx(-0.026, abs=1e-3)


@pytest.mark.parametrize(("eccentricity", "expected"), [(0.2, 0.153), (0.15, 0.118)])
def test_chaotic_libration(eccentricity: float, expected: float) -> None:
    """The mean over 128 motions of 2000 rad each has a standard error of 0.001."""
    starts = np.random.default_rng(5).uniform(-1.0, 1.0, (128, 2))
    values = largest_exponent(Libration(eccentricity), starts, 2400.0, 400.0, steps=20)
    assert isinstance(values, np.ndarray)
    assert values.mean() == pytest.approx(expected, abs=0.004)


def test_motions_that_do_not_stay_finite() -> None:
    burst = FunctionPlant(lambda t, x, u: x**2, 1, 1)
    values = largest_exponent(burst, [[1.0], [-1.0]], 10.0, interval=1.0)
    assert np.isnan(values[0])
    assert np.isfinite(values[1])


def test_bad_input_is_refused_in_sentences() -> None:
    with pytest.raises(ArgumentError, match=r"`initial_state` must have shape \(2,\) or \(b, 2\)"):
        largest_exponent(Libration(), [0.0], 10.0)
    with pytest.raises(ArgumentError, match=r"`transient` must lie in \[0, 10\), before the horizon, but is 20"):
        largest_exponent(Libration(), [0.0, 1.0], 10.0, 20.0)
    with pytest.raises(ArgumentError, match="`interval` must be positive"):
        largest_exponent(Libration(), [0.0, 1.0], 10.0, interval=0.0)
