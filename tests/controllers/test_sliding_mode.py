"""Sliding mode laws against plain transcriptions of their equations, and their adaptation against its integral."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from fracctl.controllers.adaptation import NODES, adaptation_table
from fracctl.controllers.fractional_sliding_mode import FractionalSlidingMode
from fracctl.controllers.references import Approach
from fracctl.controllers.sliding_mode import AdaptiveSlidingMode
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.plants import FunctionPlant, Tether

COMPONENTS = ("length", "theta", "phi")


def speed(theta: Any, rate: float, weight: float) -> Any:
    """dϑ/dσ of Eq. 38: e^(1/(K₁ϑ)) (1 - K₁ϑ) + ζφ K₁ e^(-2/(K₁ϑ))."""
    return mpmath.exp(1 / (rate * theta)) * (1 - rate * theta) + weight * rate * mpmath.exp(-2 / (rate * theta))


@pytest.mark.parametrize(("rate", "weight", "start"), [(0.05, 6.0, 1.0), (0.05, 0.0162, 1.0), (0.2, 1.0, 0.7)])
def test_the_table_is_the_integral_of_the_adaptation(rate: float, weight: float, start: float) -> None:
    sigma, theta, slope = adaptation_table(rate, weight, start)
    assert theta[0] == pytest.approx(start, rel=1e-14)
    for k in (30, 200, 400, NODES - 10):
        exact = mpmath.quad(lambda y: 1 / speed(y, rate, weight), [*theta[:k:12].tolist(), theta[k]])
        assert sigma[k] == pytest.approx(float(exact), rel=1e-9)
        assert slope[k] == pytest.approx(float(speed(theta[k], rate, weight)), rel=1e-6)


def test_the_gains_end_where_the_adaptation_stands_still() -> None:
    for weight in (6.0, 0.0162):
        _, theta, _ = adaptation_table(0.05, weight, 1.0)
        limit = float(mpmath.findroot(lambda y, w=weight: speed(y, 0.05, w), 20.1))
        assert theta[-1] == pytest.approx(limit, rel=1e-6)
        assert (np.diff(theta) > 0.0).all()
        with pytest.raises(ArgumentError, match="`vartheta_0` must lie below 20"):
            adaptation_table(0.05, weight, 1.001 * limit)


def test_gains_that_begin_small_are_large_at_once() -> None:
    """From ϑ = 0.01 or 0.3 to 1 it takes e^-20 of σ at most; nothing of that overflows."""
    sigma, theta, slope = adaptation_table(0.05, 6.0, 0.01)
    later, same, _ = adaptation_table(0.05, 6.0, 1.0)
    assert np.isfinite(slope).all()
    assert (np.diff(sigma) > 0.0).all()
    assert np.interp(same[300], theta, sigma) == pytest.approx(later[300], rel=1e-3)


def adapted(sigma: float, rate: float, weight: float, start: float) -> float:
    """ϑ(σ) without a table."""

    def inverse(theta: float) -> float:
        share = 1.0 / (rate * theta)
        return math.exp(-share) / (1.0 - rate * theta + weight * rate * math.exp(-3.0 * share))

    limit = brentq(lambda y: 1.0 - rate * y + weight * rate * math.exp(-3.0 / (rate * y)), 1.0, 60.0 / rate)

    def missing(theta: float) -> float:
        return quad(inverse, start, theta, epsabs=1e-15, epsrel=1e-12, limit=400)[0] - sigma

    end = limit * (1.0 - 1e-6)
    return limit if missing(end) < 0.0 else brentq(missing, start, end, xtol=1e-12)


def demanded(
    law: dict[str, Any], error: Any, error_rate: Any, fractional: Any, c: float, base: Any, peaks: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Eqs. 36 to 41 in NumPy at the end of a step, where z = b + c h."""
    x = error_rate + law["alpha_0"] * error + law["alpha_1"] * fractional
    soft = np.where(np.abs(x) < np.pi / 2.0, np.sin(x), np.sign(x))
    integral = base[:3] + c * soft
    largest = np.maximum(peaks[:3], np.abs(integral))
    gamma = np.where(law["gamma"] * largest <= 1.0, law["gamma"], law["shrink"] / largest)
    first, second = soft + gamma * integral, x + np.arcsin(gamma * integral)
    sigma = base[3:] + c * np.array([np.abs(second).sum(), (second**2).sum()])
    theta = [adapted(sigma[k], law["k_1"], law["zeta"] * law[f"phi_{k + 1}"], law["vartheta_0"]) for k in (0, 1)]
    reaching = law["zeta"] * law["phi_1"] * theta[0] * np.clip(first / law["boundary_layer"], -1.0, 1.0)
    return -(reaching + law["zeta"] * law["phi_2"] * theta[1] * second), np.concatenate([integral, sigma])


OWN = {
    "alpha_0": 1.3,
    "alpha_1": 0.7,
    "nu": 0.4,
    "zeta": 2.5,
    "phi_1": 1.7,
    "phi_2": 0.4,
    "k_1": 0.08,
    "gamma": np.array([1.1, 2.7, 0.8]),
    "shrink": 0.85,
    "boundary_layer": 0.3,
    "vartheta_0": 1.4,
}


@pytest.mark.parametrize("case", ["calm", "far", "wound up by its past", "wound up in this step", "adapted", "started"])
def test_the_demand_is_that_of_the_equations(case: str) -> None:
    law = AdaptiveSlidingMode(**OWN)
    numbers = law.numbers(Tether(), 1)[0]
    rng = np.random.default_rng(sum(map(ord, case)))
    scale, c, peak, sigma = 0.15, 1e-3, 0.1, 0.2
    if case == "far":
        scale = 2.0
    elif case == "wound up by its past":
        peak = 1.6
    elif case == "wound up in this step":
        c, scale, peak = 1.5, 1.0, 0.3
    elif case == "adapted":
        sigma = 500.0
    elif case == "started":
        c, sigma, peak = 1e-9, 0.0, 0.0
    error, error_rate, fractional = scale * rng.normal(size=(3, 3))
    base = np.concatenate([min(peak, 0.3) * rng.uniform(-1.0, 1.0, 3), [sigma, 0.7 * sigma]])
    peaks = np.full(5, peak)
    z, w = np.empty(5), np.empty(3)
    law.demand(0.3, error, error_rate, error, error_rate, fractional, c, base, peaks, numbers, z, w)
    expected, expected_z = demanded(OWN, error, error_rate, fractional, c, base, peaks)
    np.testing.assert_allclose(z, expected_z, rtol=1e-13)
    np.testing.assert_allclose(w, expected, rtol=3e-6)
    np.testing.assert_allclose(
        law.adapted(z[None])[0],
        [adapted(z[3 + k], 0.08, 2.5 * OWN[f"phi_{k + 1}"], 1.4) for k in (0, 1)],
        rtol=3e-6,
    )


def test_parameters_by_name_make_the_same_law() -> None:
    names = [parameter.name for parameter in AdaptiveSlidingMode.parameters(COMPONENTS)]
    assert names[:3] == ["alpha_0", "alpha_1", "nu"]
    assert names[11:] == [
        *("gamma_length", "gamma_theta", "gamma_phi", "reference_target", "reference_start", "reference_rate")
    ]
    default = AdaptiveSlidingMode.from_parameters(COMPONENTS, {})
    np.testing.assert_array_equal(default.numbers(Tether(), 1), AdaptiveSlidingMode().numbers(Tether(), 1))
    values = {"alpha_1": [0.0, 0.5, 0.9], "gamma_theta": 2.0, "reference_target": 0.1, "reference_rate": 0.5}
    law = AdaptiveSlidingMode.from_parameters(COMPONENTS, values)
    assert law.batch == 3
    numbers = law.numbers(Tether(), 3)
    np.testing.assert_array_equal(numbers[:, 1], [0.0, 0.5, 0.9])
    np.testing.assert_array_equal(numbers[:, 7:10], [[1.2, 2.0, 0.9]] * 3)
    wanted, slope = law.reference(np.array([0.0, 2.0]))
    np.testing.assert_allclose(np.broadcast_to(wanted, (3, 2, 3))[1, :, 0], [1.0, 0.1 + 0.9 * math.exp(-1.0)])
    np.testing.assert_allclose(np.broadcast_to(slope, (3, 2, 3))[1, :, 0], [-0.45, -0.45 * math.exp(-1.0)])


def test_orders_and_memory_are_those_of_the_definition() -> None:
    law, error = AdaptiveSlidingMode(nu=[0.3, 0.6], caputo=[0.0, 1.0]), np.arange(6.0).reshape(2, 3) + 1.0
    np.testing.assert_array_equal(law.orders(3, 2), [[0.3] * 3, [0.6] * 3])
    np.testing.assert_array_equal(law.initial_memory(error), [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(law.initial_auxiliary(2), np.zeros((2, 5)))
    other = FractionalSlidingMode(nu=0.7, caputo=1.0)
    np.testing.assert_array_equal(other.orders(3, 2), np.full((2, 3), 0.7))
    np.testing.assert_array_equal(other.initial_memory(error), np.zeros((2, 3)))
    assert other.initial_auxiliary(2).shape == (2, 0)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: AdaptiveSlidingMode(alpha_0=0.0), "`alpha_0` must lie in"),
        (lambda: AdaptiveSlidingMode(alpha_1=-0.1), "`alpha_1` must lie in"),
        (lambda: AdaptiveSlidingMode(nu=1.0), "`nu` must lie in"),
        (lambda: AdaptiveSlidingMode(nu=[0.5, 0.0]), "`nu` must lie in"),
        (lambda: AdaptiveSlidingMode(zeta=1.0), "`zeta` must lie in"),
        (lambda: AdaptiveSlidingMode(k_1=0.0), "`k_1` must lie in"),
        (lambda: AdaptiveSlidingMode(shrink=1.1), "`shrink` must lie in"),
        (lambda: AdaptiveSlidingMode(boundary_layer=0.0), "`boundary_layer` must lie in"),
        (lambda: AdaptiveSlidingMode(vartheta_0=0.0), "`vartheta_0` must lie in"),
        (lambda: AdaptiveSlidingMode(phi_2=math.nan), "`phi_2` must hold finite numbers only"),
        (lambda: AdaptiveSlidingMode(gamma=[1.0, -1.0, 1.0]), "`gamma` must hold"),
        (lambda: AdaptiveSlidingMode(gamma=1.0), "`gamma` must hold"),
        (lambda: AdaptiveSlidingMode(nu=[0.5, 0.4], alpha_1=[0.1] * 3), "must have the same batch size"),
        (lambda: AdaptiveSlidingMode(vartheta_0=21.0).numbers(Tether(), 1), "`vartheta_0` must lie below 20"),
        (lambda: AdaptiveSlidingMode(gamma=(1.0, 2.0)).numbers(Tether(), 1), r"must have shape \(3,\) or \(b, 3\)"),
        (lambda: FractionalSlidingMode(k=0.0), "`k` must lie in"),
        (lambda: FractionalSlidingMode(eta=-1.0), "`eta` must lie in"),
        (lambda: FractionalSlidingMode(nu=1.0), "`nu` must lie in"),
        (lambda: Approach(rate=-0.5), "`rate` must not be negative"),
        (lambda: Approach(target=math.inf), "`target` must hold finite numbers only"),
    ],
)
def test_laws_refuse_in_sentences(make: Callable[[], object], sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()


def test_the_reconstruction_is_a_law_for_tethers() -> None:
    with pytest.raises(UnsupportedError, match="is a law for a tether, not for FunctionPlant"):
        FractionalSlidingMode().numbers(FunctionPlant(lambda t, x, u: x, 6, 3), 1)


def test_references_of_many_make_a_batch() -> None:
    for kind in (AdaptiveSlidingMode, FractionalSlidingMode):
        assert kind(reference=Approach(0.1, 1.0, [0.5, 0.7])).batch == 2
        assert kind(reference=Approach(0.1)).batch is None
        with pytest.raises(ArgumentError, match="must have the same batch size"):
            kind(nu=[0.5] * 3, reference=Approach(0.1, 1.0, [0.5, 0.7]))


def test_approaches_are_exponentials_and_steps() -> None:
    times, step = np.linspace(0.0, 5.0, 7), 1e-6
    approach = Approach(0.1, [1.0, 0.8], [0.5, 0.0], components=2)
    value, slope = approach(times)
    assert value.shape == slope.shape == (2, 7, 2)
    np.testing.assert_allclose(value[0, :, 0], 0.1 + 0.9 * np.exp(-0.5 * times))
    np.testing.assert_array_equal(value[1, :, 0], 0.1)
    np.testing.assert_array_equal(value[..., 1], 0.0)
    later, before = approach(times + step)[0], approach(times - step)[0]
    np.testing.assert_allclose(slope, (later - before) / (2.0 * step), atol=1e-9)
    assert Approach()(times)[0].shape == (7, 3)


RECONSTRUCTION = {"c_1": 0.8, "b_1": 0.6, "c_2": 1.2, "kappa": -0.3, "k": 1.4, "eta": 0.2, "boundary_layer": 0.1}


@pytest.mark.parametrize("scale", [0.02, 0.5])
def test_the_reconstruction_reaches_its_surface_on_its_design_model(scale: float) -> None:
    """On a planar circular orbit d/df (λ' + c₁Δλ + κ(θ' + c₂θ)) = -kS - η sat(S/ε), with S that has D^ν too."""
    law = FractionalSlidingMode(**RECONSTRUCTION)
    plant = Tether(0.0, disturbance=(0.0, 0.0, 0.0))
    rng = np.random.default_rng(5)
    for _ in range(5):
        q, rate = np.array([0.7, 0.0, 0.0]) + scale * rng.normal(size=3), scale * rng.normal(size=3)
        q[2] = rate[2] = 0.0
        error, fractional, w = q - np.array([1.0, 0.0, 0.0]), scale * rng.normal(size=3), np.empty(3)
        numbers = law.numbers(plant, 1)[0]
        law.demand(0.4, q, rate, error, rate, fractional, 0.1, np.empty(0), np.empty(0), numbers, np.empty(0), w)
        np.testing.assert_array_equal(w[1:], 0.0)
        second = plant.rates(np.array([0.4]), np.concatenate([q, rate])[None], w[None])[0, 3:]
        own = rate[0] + 0.8 * error[0] - 0.3 * (rate[1] + 1.2 * q[1])
        surface = own + 0.6 * fractional[0]
        change = second[0] + 0.8 * rate[0] - 0.3 * (second[1] + 1.2 * rate[1])
        assert change == pytest.approx(-1.4 * surface - 0.2 * np.clip(surface / 0.1, -1.0, 1.0), abs=1e-13)
