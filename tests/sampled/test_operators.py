"""Fractional operators of sampled signals: weights, closed forms, and the frequency response they stand for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import binom, gamma

from fracctl.errors import ArgumentError
from fracctl.fractional.sampled import grunwald_letnikov, l1
from fracctl.sampled import Exponentials, Memory, Oustaloup, Window
from fracctl.sampled.operators import SampledOperator, difference, lags, trapezoid
from fracctl.sampled.window import grunwald_letnikov_weights

STEP = 0.01
TIMES = STEP * np.arange(1500)
MEMORIES = [Window(1500), Exponentials(30.0, 1e-6), Oustaloup(1e-3, 1e5, 14)]


@pytest.mark.parametrize("order", [0.3, 0.91, -0.5, 1.0])
def test_weights_are_binomial_coefficients(order: float) -> None:
    k = np.arange(40)
    np.testing.assert_allclose(grunwald_letnikov_weights(order, 40), (-1.0) ** k * binom(order, k), atol=1e-15)


@pytest.mark.parametrize("order", [0.2, 0.91])
def test_a_window_that_is_not_full_is_the_whole_sum(order: float) -> None:
    signal = np.sin(TIMES)
    np.testing.assert_allclose(
        Window(1500).derivative(order, STEP)(signal), grunwald_letnikov(signal, STEP, order), atol=1e-10
    )
    np.testing.assert_allclose(
        Window(1500).integral(order, STEP)(signal), grunwald_letnikov(signal, STEP, -order), atol=1e-10
    )


@pytest.mark.parametrize("order", [0.2, 0.91])
def test_a_full_window_is_the_caputo_derivative_from_its_oldest_sample(order: float) -> None:
    reach = 200 * STEP
    last = Window(201).derivative(order, STEP)(TIMES)[-1]
    assert last == pytest.approx(reach ** (1.0 - order) / gamma(2.0 - order), rel=5e-3)


@pytest.mark.parametrize("order", [0.2, 0.91])
def test_modes_are_exact_for_lines_between_samples(order: float) -> None:
    signal = np.cos(TIMES) + 0.3 * TIMES
    found = Exponentials(30.0, 1e-9).derivative(order, STEP)(signal)
    np.testing.assert_allclose(found, l1(signal, STEP, order), atol=1e-7)
    found = Exponentials(30.0, 1e-9).integral(order, STEP)(TIMES)
    np.testing.assert_allclose(found, TIMES ** (1.0 + order) / gamma(2.0 + order), atol=1e-7)


@pytest.mark.parametrize("memory", MEMORIES, ids=lambda memory: type(memory).__name__)
@pytest.mark.parametrize("order", [0.3, 0.91])
def test_derivatives_of_powers(memory: Memory, order: float) -> None:
    """Caputo's D^α t² = 2 t^(2-α)/Γ(3-α); the window errs by O(h), Oustaloup's filter by its band."""
    found = memory.derivative(order, STEP)(3.0 + TIMES**2) - 3.0 * (1e-3**order if isinstance(memory, Oustaloup) else 0)
    expected = 2.0 * TIMES ** (2.0 - order) / gamma(3.0 - order)
    assert np.abs(found - expected)[:500].max() < 0.03 * expected[:500].max()


@pytest.mark.parametrize("memory", MEMORIES, ids=lambda memory: type(memory).__name__)
def test_a_memory_that_begins_at_a_constant_has_no_derivative_and_no_integral(memory: Memory) -> None:
    derivative = memory.derivative(0.6, STEP)(np.full(5, 2.0))
    rest = 2.0 * 1e-3**0.6 if isinstance(memory, Oustaloup) else 0.0
    np.testing.assert_allclose(derivative, rest, atol=1e-9)
    integral = memory.integral(0.6, STEP)(np.full(1500, 2.0))
    first = {"Window": 2.0 * STEP**0.6, "Exponentials": 0.0, "Oustaloup": 2.0 * 1e5**-0.6}[type(memory).__name__]
    assert integral[0] == pytest.approx(first, abs=1e-12)
    assert integral[-1] == pytest.approx(2.0 * TIMES[-1] ** 0.6 / gamma(1.6), rel=6e-3)


@pytest.mark.parametrize("order", [-0.7, 0.3, 0.91])
def test_oustaloup_keeps_to_its_band(order: float) -> None:
    """A decade inside its band the filter of one pole for each half decade errs by less than 1 %."""
    omega = np.logspace(-1.0, 1.0, 60)
    wide = Oustaloup(1e-3, 1e3, 12)
    assert np.abs(wide.response(order, omega) / (1j * omega) ** order - 1.0).max() < 0.012
    sampled = wide.integral(-order, 1e-3) if order < 0.0 else wide.derivative(order, 1e-3)
    np.testing.assert_allclose(sampled.response(1e-3 * omega), wide.response(order, omega), rtol=1e-3)


def test_lags_are_exact_for_lines() -> None:
    rates, weights = np.array([0.0, 1e-6, 0.7, 500.0]), np.array([1.0, 0.5, 2.0, 3.0])
    s = np.array([0.7, 500.0])[:, None]
    ramp = (TIMES - (1.0 - np.exp(-s * TIMES)) / s) / s
    expected = 1.5 * (0.5 * TIMES**2) + 2.0 * ramp[0] + 3.0 * ramp[1] + 4.0 * TIMES
    np.testing.assert_allclose(lags(rates, weights, 4.0, STEP)(TIMES), expected, rtol=2e-6, atol=1e-12)


def test_difference_and_trapezoid() -> None:
    np.testing.assert_allclose(difference(STEP)(TIMES**2)[1:], 2.0 * TIMES[1:] - STEP, rtol=1e-10)
    np.testing.assert_allclose(trapezoid(STEP)(5.0 + TIMES), 5.0 * TIMES + 0.5 * TIMES**2, atol=1e-12)


@pytest.mark.parametrize("memory", MEMORIES, ids=lambda memory: type(memory).__name__)
def test_the_response_is_the_transform_of_the_pulse_response(memory: Memory) -> None:
    operator = memory.derivative(0.8, 0.5)
    at_rest = SampledOperator(operator.a, operator.b, operator.c, operator.f, np.zeros_like(operator.e))
    pulse = at_rest(np.eye(1500)[0])
    phase = np.array([0.3, 1.1, np.pi])
    expected = np.exp(-1j * np.outer(phase, np.arange(1500))) @ pulse
    np.testing.assert_allclose(operator.response(phase), expected, atol=1e-3)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Window(1), "samples"),
        (lambda: Oustaloup(2.0, 1.0, 3), "lowest"),
        (lambda: Oustaloup(0.1, 1.0, 0), "order"),
        (lambda: Exponentials(-1.0), "longest"),
        (lambda: Exponentials(math.inf), "longest"),
    ],
)
def test_refusals(make: object, name: str) -> None:
    with pytest.raises(ArgumentError, match=f"`{name}`"):
        make()  # type: ignore[operator]
