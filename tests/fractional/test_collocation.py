"""Fractional differentiation matrices against Γ functions, incomplete beta functions and Mittag-Leffler functions.

The rounding that a derivative of order α of node values cannot avoid grows as n^(2α), the largest derivative of a
polynomial of degree n that is bounded by 1 (Markov's inequality between integer orders).
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from fracctl.fractional.collocation import (
    chebyshev_nodes,
    derivative_matrix,
    integral_matrix,
    memory_matrix,
    power_derivative,
)
from tests.references.series import mittag_leffler

SIZES = [3, 6, 17, 32, 65]
ORDERS = [-1.0, -0.62, -0.09, 0.0, 0.01, 0.3, 0.5, 0.91, 0.999, 1.0, 1.001, 1.3, 1.5, 1.91, 2.0]
EPS = np.finfo(float).eps


def exact(power: int, order: float, times: np.ndarray) -> np.ndarray:
    """Return D^order t^p = Γ(p+1)/Γ(p-order+1) t^(p-order), 0 for p < order (Eq. 14 of the paper, and Caputo)."""
    if power < order:
        return np.zeros_like(times)
    factor = float(mpmath.gamma(power + 1) / mpmath.gamma(power + 1 - mpmath.mpf(order)))
    return factor * times ** (power - order)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("order", ORDERS)
def test_exact_on_powers_to_rounding(n: int, order: float) -> None:
    points = np.array([0.0, 1e-9, 1e-3, 0.2, 0.7, 1.0])
    for power in sorted({0, 1, 2, n // 2, n - 1}):
        values = chebyshev_nodes(n).t ** power
        allowed = 20.0 * EPS * n ** (2.0 * max(order, 0.0) + 0.5)
        assert np.abs(derivative_matrix(n, order) @ values - exact(power, order, chebyshev_nodes(n).t)).max() < allowed
        assert np.abs(derivative_matrix(n, order, points) @ values - exact(power, order, points)).max() < allowed


@pytest.mark.parametrize("n", SIZES)
def test_one_and_two_are_the_ordinary_derivatives(n: int) -> None:
    polynomial = np.polynomial.Polynomial(np.random.default_rng(n).uniform(-1.0, 1.0, n))
    t = chebyshev_nodes(n).t
    for order in (0, 1, 2):
        wanted = polynomial.deriv(order)(t) if order else polynomial(t)
        computed = derivative_matrix(n, float(order)) @ polynomial(t)
        assert np.abs(computed - wanted).max() < 60.0 * EPS * n ** (2.0 * order + 1.5)


@pytest.mark.parametrize("limit", [1.0, 2.0])
def test_orders_tend_to_integer_orders_from_below(limit: float) -> None:
    """D^(k-ε) f → f^(k) for t > 0, the difference of order ε."""
    n = 17
    t = chebyshev_nodes(n).t[1:]
    values = np.cos(2.0 * chebyshev_nodes(n).t)
    wanted = -2.0 * np.sin(2.0 * t) if limit == 1.0 else -4.0 * np.cos(2.0 * t)
    differences = [np.abs((derivative_matrix(n, limit - e) @ values)[1:] - wanted).max() for e in (1e-3, 1e-6, 1e-9)]
    assert differences[0] < 3e-2
    assert differences[1] == pytest.approx(1e-3 * differences[0], rel=0.02)
    assert differences[2] < 1e-7


def test_orders_tend_to_integer_orders_from_above_up_to_initial_values() -> None:
    """Caputo's derivative: D^ε f → f - f(0), D^(1+ε) f → f' - f'(0)."""
    n = 17
    t = chebyshev_nodes(n).t
    values = np.exp(t)
    for order, wanted in ((1e-9, values - 1.0), (1.0 + 1e-9, values - 1.0)):
        assert np.abs((derivative_matrix(n, order) @ values - wanted)[1:]).max() < 1e-7


@pytest.mark.parametrize("order", [-0.5, 0.3, 0.91, 1.4])
def test_spectral_on_a_smooth_function(order: float) -> None:
    """D^α e^t = t^(k-α) E_{1,k+1-α}(t), k = ⌈α⌉ (k = 0 for integrals)."""
    points = np.array([0.01, 0.3, 0.8, 1.0])
    k = max(int(np.ceil(order)), 0)
    with mpmath.workdps(25):
        wanted = [float(t ** (k - order) * mittag_leffler(1, k + 1 - order, t)) for t in points]
    errors = {
        n: np.abs(derivative_matrix(n, order, points) @ np.exp(chebyshev_nodes(n).t) - wanted).max()
        for n in (4, 6, 8, 10, 16)
    }
    assert errors[16] < 1e-12
    for fewer, more in ((4, 6), (6, 8), (8, 10)):
        assert errors[more] < 0.03 * errors[fewer]


@pytest.mark.parametrize("n", [6, 17, 32, 48])
@pytest.mark.parametrize("order", [0.03, 0.5, 1.0, 1.09, 2.0, 3.0])
@pytest.mark.parametrize("distance", [1, 2, 7])
def test_memory_of_an_earlier_panel(n: int, order: float, distance: int) -> None:
    """1/Γ(μ) ∫₀¹ (t-τ)^(μ-1) τ^p dτ = t^(μ+p)/Γ(μ) B(1/t; p+1, μ)."""
    matrix = memory_matrix(n, order, distance)
    nodes = chebyshev_nodes(n).t
    for power in (0, 1, n // 2, n - 1):
        for i in (0, 1, n // 3, n - 1):
            with mpmath.workdps(30):
                t = mpmath.mpf(distance) + mpmath.mpf(nodes[i])
                beta = mpmath.betainc(power + 1, order, 0, 1 / t)
                wanted = float(t ** (order + power) * beta / mpmath.gamma(order))
            assert matrix[i] @ nodes**power == pytest.approx(wanted, rel=1e-12, abs=2e-13)


def test_no_memory_without_an_integral() -> None:
    assert not memory_matrix(8, 0.0, 1).any()
    np.testing.assert_array_equal(integral_matrix(8, 0.0), np.eye(8))


@pytest.mark.parametrize("n", [2, 9, 64])
def test_nodes_and_interpolation(n: int) -> None:
    nodes = chebyshev_nodes(n)
    np.testing.assert_allclose(nodes.t, 0.5 - 0.5 * np.cos(np.pi * np.arange(n) / (n - 1)), atol=1e-15)
    np.testing.assert_array_equal(nodes.interpolation(nodes.t), np.eye(n))
    points = np.random.default_rng(n).uniform(0.0, 1.0, 20)
    np.testing.assert_allclose(nodes.interpolation(points) @ nodes.t, points, atol=1e-14)


@pytest.mark.parametrize(
    ("exponent", "order", "wanted"),
    [
        (0.0, 0.4, 0.0),
        (1.0, 1.2, 0.0),
        (1.0, 1.0, 1.0),
        (0.0, 0.0, 1.0),
        (0.0, -1.0, 0.3),
        (2.0, 1.0, 0.3),
        (0.0, -0.5, 2.0 * np.sqrt(0.3 / np.pi)),
        (1.0, 0.5, 2.0 * np.sqrt(0.3 / np.pi)),
    ],
)
def test_derivative_of_a_power(exponent: float, order: float, wanted: float) -> None:
    assert power_derivative(exponent, order, np.array([0.3]))[0] == pytest.approx(wanted, rel=1e-14)
