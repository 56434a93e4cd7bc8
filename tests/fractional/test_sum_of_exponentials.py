"""The power-law kernel as a sum of exponentials: its bound holds, and derivatives by it against closed forms and L1."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import gamma, rgamma

from fracctl.controllers import LinearLawTerms
from fracctl.errors import ArgumentError
from fracctl.fractional.collocation import chebyshev_nodes
from fracctl.fractional.sampled import grunwald_letnikov, l1
from fracctl.fractional.sum_of_exponentials import sum_of_exponentials
from fracctl.fractional.terms import FractionalTerm
from fracctl.solvers.explicit_memory.history import History
from fracctl.solvers.explicit_memory.law import signals
from fracctl.solvers.explicit_memory.mesh import step_edges

ORDERS = [0.01, 0.09, 0.3, 0.5, 0.7, 0.9, 0.99]
RANGES = [(1e-10, 40.0), (1e-3, 1.0), (0.5, 0.5), (1.0, 1e6)]
TOLERANCES = [1e-2, 1e-5, 1e-8, 1e-12]
NODES = 14


def kernel_error(order: np.ndarray, weights: np.ndarray, rates: np.ndarray, times: np.ndarray) -> np.ndarray:
    """The largest relative error, (b,), with the sum written out."""
    exact = times ** (order[:, None] - 1.0) / gamma(order)[:, None]
    return np.abs(weights @ np.exp(-rates[:, None] * times) / exact - 1.0).max(axis=1)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("extent", RANGES)
@pytest.mark.parametrize("order", ORDERS)
def test_the_bound_holds_for_an_order(order: float, extent: tuple[float, float], tolerance: float) -> None:
    found = sum_of_exponentials(order, *extent, tolerance)
    times = np.geomspace(*extent, 4000)
    error = kernel_error(np.array([order]), found.weights[None], found.rates, times).item()
    assert error <= found.error_bound <= tolerance
    assert (np.diff(found.rates) > 0.0).all()
    np.testing.assert_allclose(found.kernel(times[:5]), times[:5] ** (order - 1.0) * rgamma(order), rtol=tolerance)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("extent", RANGES)
def test_the_bound_holds_for_a_batch_of_orders_with_the_same_rates(
    extent: tuple[float, float], tolerance: float
) -> None:
    orders = np.array(ORDERS)
    found = sum_of_exponentials(orders, *extent, tolerance)
    error = kernel_error(orders, found.weights, found.rates, np.geomspace(*extent, 4000))
    assert found.weights.shape == (len(orders), len(found.rates))
    assert (error <= found.error_bound).all()
    assert (found.error_bound <= tolerance).all()


def test_the_bound_is_no_overstatement() -> None:
    """Within two digits of what is there."""
    found = sum_of_exponentials(0.5, 1e-6, 10.0, 1e-6)
    error = kernel_error(np.array([0.5]), found.weights[None], found.rates, np.geomspace(1e-6, 10.0, 20_000)).item()
    assert found.error_bound < 100.0 * error


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((1.0, 0.1, 1.0), "`order` must lie in"),
        (([0.5, 0.0], 0.1, 1.0), "`order` must lie in"),
        ((0.5, 0.0, 1.0), "`shortest` must be positive"),
        ((0.5, 2.0, 1.0), "not above `longest`, 1"),
        ((0.5, 0.1, 1.0, 1e-15), "`tolerance` must lie in"),
    ],
)
def test_what_is_out_of_range_is_refused(arguments: tuple[float, ...], said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        sum_of_exponentials(*arguments)


def sine(times: np.ndarray, order: float) -> np.ndarray:
    """D^ν sin t = Σ_k (-1)^k t^(2k+1-ν)/Γ(2k+2-ν); Caputo's and Riemann-Liouville's are the same, for sin 0 = 0."""
    k = np.arange(40)[:, None]
    return np.sum((-1.0) ** k * times ** (2 * k + 1 - order) * rgamma(2 * k + 2 - order), axis=0)


def by_exponentials(order: float, horizon: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and D^ν sin there, by the memory of the solver: fed with cos, read at the nodes of all steps."""
    law = signals(LinearLawTerms((FractionalTerm(np.ones((1, 1)), np.array([order])),)), 1)
    edges = step_edges(horizon, 8, 1e-9, np.zeros(0), powers=True)
    history = History(law, 1, NODES, float(np.diff(edges).min()), horizon, 1e-11)
    times, found = [], []
    for start, step in zip(edges[:-1], np.diff(edges), strict=True):
        at = start + step * chebyshev_nodes(NODES).t
        values = np.stack([np.sin(at), np.cos(at), -np.sin(at)])[:, None]
        memory = history.before(float(step)) + history.on_step(float(step), values)
        history.keep(float(step), values)
        times.append(at[1:])
        found.append(memory[0, 0, 1:])
    return np.concatenate(times), np.concatenate(found)


@pytest.mark.parametrize("order", [0.1, 0.5, 0.91, 0.99])
def test_derivatives_of_a_sine_to_ten_digits(order: float) -> None:
    times, found = by_exponentials(order, 5.0)
    assert np.abs(found - sine(times, order)).max() < 1e-10


def test_operators_that_remember_every_sample_agree_at_their_accuracy() -> None:
    """D^½ sin t up to 5, with 20 000 samples; three ways to one function."""
    times = 2.5e-4 * np.arange(20_001)
    exact, samples = sine(times, 0.5), np.sin(times)
    errors = {
        "gl": np.abs(grunwald_letnikov(samples, 2.5e-4, 0.5) - exact).max(),
        "l1": np.abs(l1(samples, 2.5e-4, 0.5) - exact).max(),
    }
    nodes, found = by_exponentials(0.5, 5.0)
    assert 3e-5 < errors["gl"] < 3e-3
    assert 1e-7 < errors["l1"] < 1e-5
    assert np.abs(found - sine(nodes, 0.5)).max() < 1e-10


@pytest.mark.parametrize("order", [0.2, 0.5, 0.8])
def test_orders_of_convergence(order: float) -> None:
    """Of t³ at t = 1: one for Grünwald-Letnikov, 2-ν for L1."""
    counts = np.array([100, 200, 400, 800])
    exact = gamma(4.0) / gamma(4.0 - order)
    errors = {grunwald_letnikov: [], l1: []}
    for operator, found in errors.items():
        for n in counts:
            samples = (np.arange(n + 1) / n) ** 3
            found.append(abs(operator(samples, 1.0 / n, order)[-1] - exact))
    slopes = {operator: -np.polyfit(np.log(counts), np.log(found), 1)[0] for operator, found in errors.items()}
    assert slopes[grunwald_letnikov] == pytest.approx(1.0, abs=0.05)
    assert slopes[l1] == pytest.approx(2.0 - order, abs=0.1)


def test_constants_tell_riemann_and_liouville_from_caputo() -> None:
    ones = np.ones((2, 4001))
    assert l1(ones, 1e-3, 0.5).tolist() == np.zeros((2, 4001)).tolist()
    np.testing.assert_allclose(grunwald_letnikov(ones, 1e-3, 0.5)[:, -1], 4.0**-0.5 / np.sqrt(np.pi), rtol=1e-3)


def test_an_integral_is_undone_by_the_derivative() -> None:
    """The weights of ν and -ν are those of (1-z)^ν and of its inverse: exact but for rounding."""
    samples = np.sin(0.01 * np.arange(500))
    there = grunwald_letnikov(samples, 0.01, -0.3)
    np.testing.assert_allclose(grunwald_letnikov(there, 0.01, 0.3), samples, atol=1e-12)


@pytest.mark.parametrize("operator", [grunwald_letnikov, l1])
@pytest.mark.parametrize(
    ("values", "step", "order", "said"),
    [([1.0], 0.1, 0.5, "`values` must"), ([1.0, 2.0], 0.0, 0.5, "`step` must"), ([1.0, 2.0], 0.1, 1.0, "`order` must")],
)
def test_signals_that_are_refused(operator: object, values: list[float], step: float, order: float, said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        operator(values, step, order)  # type: ignore[operator]
