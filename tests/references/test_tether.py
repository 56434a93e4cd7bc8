"""The reference of the tether: its kernel and adaptation in closed form, SciPy's methods against each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import gamma

from fracctl.plants import Tether
from tests.references import tether
from tests.references.tether import ORBIT, SlidingMode, Tension, grid, retrieved, solve

CASE_1, CASE_2 = [0.0009, 0.1, 0.1, 0.7, 0.0, 0.0], [0.0009, 0.1, 0.1, 0.6, 0.0, 0.0]
FDA, DA = SlidingMode(), SlidingMode(alpha_1=0.0)


@pytest.mark.parametrize("order", [0.3, 0.5, 0.8])
def test_the_kernel_is_a_sum_of_exponentials(order: float) -> None:
    times, (s, w) = np.geomspace(1e-6, 40.0, 400), tether.modes(order)
    exact = times**-order / gamma(1.0 - order)
    np.testing.assert_allclose(np.exp(-np.outer(times, s)) @ w, exact, rtol=6e-8)


def test_accelerations_are_those_of_the_plant() -> None:
    rng = np.random.default_rng(5)
    x, u, amplitudes = rng.uniform(0.3, 1.0, (4, 6)), rng.normal(size=(4, 3)), [0.1, 0.2, -0.3]
    plant = Tether(0.17, disturbance=amplitudes, disturbance_phase=0.4)
    expected = tether.accelerations(2.0, x[:, :3].T, x[:, 3:].T, u.T, 0.17, np.array(amplitudes), 0.4)
    np.testing.assert_allclose(plant.rates(np.full(4, 2.0), x, u)[:, 3:], expected.T, rtol=1e-12)


def test_adaptation_has_a_closed_form_for_its_inverse() -> None:
    """dσ/dϑ = e^(-1/(K₁ϑ))/[(1 - K₁ϑ) + ζφK₁ e^(-3/(K₁ϑ))], σ = ∫|S_r2| for ϑ₁ and ∫S_r2² for ϑ₂."""

    def inverse(theta: float, gain: float) -> float:
        power = 1.0 / (FDA.k_1 * theta)
        return math.exp(-power) / ((1.0 - FDA.k_1 * theta) + gain * FDA.k_1 * math.exp(-3.0 * power))

    raw = solve_ivp(
        lambda _, theta: FDA.adaptation(theta[:, None])[:, 0], (0.0, 2.0), [1.0, 1.0], "Radau", rtol=1e-10, atol=1e-12
    )
    for theta, gain in zip(raw.y[:, -1], (6.0, 0.0162), strict=True):
        assert quad(inverse, 1.0, theta, args=(gain,), epsrel=1e-10)[0] == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize("law", [FDA, DA, SlidingMode(caputo=True), Tension()])
def test_two_methods_agree_over_a_twentieth_of_an_orbit(law: SlidingMode | Tension) -> None:
    times = np.linspace(0.0, 0.05 * ORBIT, 30)
    one, other = (solve(law, CASE_1, times, method=method, rtol=1e-8, atol=1e-11) for method in ("BDF", "LSODA"))
    np.testing.assert_allclose(one.y[:6], other.y[:6], rtol=2e-6, atol=2e-7)
    assert np.isfinite(one.y).all()


def test_a_step_of_the_goal_makes_the_satellites_meet() -> None:
    run = solve(
        DA, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], grid(ORBIT), goal=lambda f: (np.array([0.1, 0.0, 0.0]), np.zeros(3))
    )
    assert run.f[-1] < ORBIT
    assert run.y[0, -1] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "start", "e", "settling", "overshoot", "turns"),
    [
        (FDA, CASE_1, 0.0027, 0.273, 0.512, 0.421),
        (DA, CASE_1, 0.0027, 0.481, 2.734, 0.370),
        (DA, [0.0009, 0.1, 0.1, 0.74, 0.0, 0.0], 0.0027, 0.431, 2.171, 0.380),
        (SlidingMode(phi=(2.0, 0.41)), CASE_2, 0.17, 0.258, 1.523, 0.391),
        (SlidingMode(alpha_1=0.0, phi=(2.0, 0.41)), CASE_2, 0.17, 0.561, 4.570, 0.351),
        (SlidingMode(gamma_0=(0.0, 0.0, 0.0)), CASE_1, 0.0027, 0.589, -0.178, math.nan),
        (SlidingMode(alpha_1=0.0, gamma_0=(0.0, 0.0, 0.0)), CASE_1, 0.0027, 0.391, 0.027, 1.355),
    ],
)
def test_deployment(
    law: SlidingMode, start: list[float], e: float, settling: float, overshoot: float, turns: float
) -> None:
    run = solve(law, start, grid(2.0 * ORBIT), e)
    assert run.settling(0.02) == pytest.approx(settling, abs=1e-3)
    assert 100.0 * (run.y[0].max() - 1.0) == pytest.approx(overshoot, abs=2e-3)
    assert run.first_negative_rate == pytest.approx(turns, abs=2e-3, nan_ok=True)
    assert run.tension.min() == pytest.approx(0.10, abs=1e-9)
    assert run.tension.max() <= 5.0 + 1e-9


@pytest.mark.slow
def test_angles_settle_sooner_without_the_fractional_term() -> None:
    """To 2 % of their start, 0.002 rad; neither passes zero by more than 2e-5 rad."""
    for law, theta, phi in ((FDA, 0.465, 0.463), (DA, 0.359, 0.356)):
        run = solve(law, CASE_1, grid(2.0 * ORBIT))
        assert run.settling(0.002, 1, 0.0) == pytest.approx(theta, abs=1e-3)
        assert run.settling(0.002, 2, 0.0) == pytest.approx(phi, abs=1e-3)
        assert run.y[1:3].min() > -2e-5


@pytest.mark.slow
def test_with_the_caputo_derivative_the_length_does_not_settle() -> None:
    run = solve(SlidingMode(caputo=True), CASE_1, grid(3.0 * ORBIT))
    assert math.isnan(run.settling(0.02))
    assert run.y[0].max() < 0.97


@pytest.mark.slow
def test_the_reconstructed_law_settles_late_and_not_at_all_on_the_eccentric_orbit() -> None:
    run = solve(Tension(), CASE_1, grid(4.0 * ORBIT))
    assert run.settling(0.02) == pytest.approx(1.672, abs=2e-3)
    late = run.y[0, run.f > 2.0 * ORBIT] - 1.0
    assert (late.min(), late.max()) == pytest.approx((-0.0157, 0.0063), abs=2e-4)
    assert math.isnan(solve(Tension(), CASE_2, grid(4.0 * ORBIT), 0.17).settling(0.02))


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "settling"), [(0.5, 1.2435), (0.7, 0.8794), (1.0, 0.5654)])
def test_retrieval_to_a_tenth_within_two_percent_of_the_span(rate: float, settling: float) -> None:
    run = solve(FDA, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], grid(2.0 * ORBIT), goal=retrieved(0.1, rate))
    assert run.settling(0.018, 0, 0.1) == pytest.approx(settling, abs=1e-3)
    assert run.y[0].min() > 0.0999
