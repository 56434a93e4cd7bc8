"""Delays that seek the period: against the ordinary equation of the delay for a motion that is known, and periods."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from fracctl.controllers import AdaptiveDelayedFeedback, DelayedFeedback, DelayedSum, Saturation
from fracctl.design import lqr
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.measures import delta_v_per_orbit, drift_per_orbit, periodicity_error
from fracctl.plants import HCW, Chief, FunctionPlant, Libration, RelativeMotion
from fracctl.solvers import MethodOfSteps

TURN = 2.0 * np.pi
KNOWN = FunctionPlant(lambda t, x, u: np.stack([np.cos(t), -2.0 * np.sin(2.0 * t)], 1) + 0.0 * u, 2, 2)
"""x = (sin t, cos 2t) whatever is done."""


def error_and_slope(t: float, delay: float) -> tuple[np.ndarray, np.ndarray]:
    s = t - delay
    error = np.array([np.sin(t) - np.sin(s), np.cos(2.0 * t) - np.cos(2.0 * s)])
    return error, np.array([np.cos(s), -2.0 * np.sin(2.0 * s)])


def product(t: float, delay: float, k: int) -> float:
    """eᵀ x'_τ for k = 0, |x'_τ|² for k = 1."""
    pair = error_and_slope(t, delay)
    return float(pair[k] @ pair[1])


def test_the_continuous_law() -> None:
    """τ' = -γ eᵀ x'(t - τ) by another integrator, from two delays and with two rates."""
    rates, delays, times = np.array([0.03, 0.2]), np.array([5.9, 6.6]), np.linspace(7.0, 40.0, 12)
    law = AdaptiveDelayedFeedback(0.1 * np.eye(2), delays, rates, "always")
    trajectory = MethodOfSteps(60).solve(ClosedLoop(KNOWN, law), [0.0, 1.0], 40.0)
    for i, rate in enumerate(rates):

        def slope(t: float, y: np.ndarray, rate: float = rate) -> list[float]:
            return [-rate * np.dot(*error_and_slope(t, y[0]))]

        run = solve_ivp(slope, (delays[i], 40.0), [delays[i]], "DOP853", times, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(trajectory.delay(times)[i], run.y[0], rtol=0, atol=1e-9)
        error = error_and_slope(39.0, trajectory.delay([39.0])[i, 0])[0]
        np.testing.assert_allclose(trajectory.control([39.0])[i, 0], -0.1 * error, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(trajectory.delay([0.0, 5.8])[0], 5.9)


def test_a_batch_of_rates_keeps_a_gain_that_depends_on_time() -> None:
    """K(t) = 0.1 sin t: the control of each of two rates is that of the rate alone."""

    def gain(times: np.ndarray) -> np.ndarray:
        return 0.1 * np.sin(times)[..., None, None] * np.eye(2)

    times = np.array([8.0, 11.3, 17.9])
    together = MethodOfSteps(40).solve(
        ClosedLoop(KNOWN, AdaptiveDelayedFeedback(gain, 6.0, np.array([0.02, 0.1]), "always")), [0.0, 1.0], 20.0
    )
    for i, rate in enumerate((0.02, 0.1)):
        alone = MethodOfSteps(40).solve(
            ClosedLoop(KNOWN, AdaptiveDelayedFeedback(gain, 6.0, rate, "always")), [0.0, 1.0], 20.0
        )
        assert np.abs(alone.control(times)).max() > 1e-3
        np.testing.assert_allclose(together.control(times)[i], alone.control(times), rtol=0, atol=1e-12)


def test_a_sum_does_not_adapt() -> None:
    law = DelayedSum(AdaptiveDelayedFeedback(np.zeros((2, 2)), 6.0), DelayedFeedback(np.zeros((2, 2)), 5.0))
    with pytest.raises(UnsupportedError, match="adapts a delay that stands alone; use one law"):
        MethodOfSteps().solve(ClosedLoop(KNOWN, law), [0.0, 1.0], 20.0)


def test_the_law_per_orbit() -> None:
    """τ ← τ - γ ∫ eᵀ x'_τ/∫ |x'_τ|² after each τ, with the integrals by quadrature; adaptation begins late."""
    law = AdaptiveDelayedFeedback(np.zeros((2, 2)), 6.0, 0.7, switch_on=6.5, adapt_from=7.0)
    trajectory = MethodOfSteps(60).solve(ClosedLoop(KNOWN, law), [0.0, 1.0], 40.0)
    start, delay = 7.0, 6.0
    while start < 30.0:
        middle = trajectory.delay([start + 0.5 * delay])[0]
        assert middle == pytest.approx(delay, abs=1e-9)
        parts = [quad(product, start, start + delay, (delay, k))[0] for k in (0, 1)]
        start, delay = start + delay, delay - 0.7 * parts[0] / parts[1]
    assert delay == pytest.approx(TURN, abs=0.01)


@pytest.mark.parametrize("renewal", ["always", "per_orbit"])
def test_without_a_rate_it_is_delayed_feedback(renewal: str) -> None:
    gain, start, t = [[0.0, 0.3]], [0.0, 1.0], np.linspace(0.0, 40.0, 101)
    for switch_on, saturation in ((None, None), (9.0, Saturation(1e3))):
        fixed = ClosedLoop(Libration(), DelayedFeedback(gain, TURN, switch_on), saturation)
        adaptive = AdaptiveDelayedFeedback(gain, TURN, 0.0, renewal, switch_on)
        one = MethodOfSteps(80).solve(fixed, start, 40.0)
        other = MethodOfSteps(80).solve(ClosedLoop(Libration(), adaptive, saturation), start, 40.0)
        np.testing.assert_allclose(other(t), one(t), rtol=0, atol=3e-9)
        np.testing.assert_allclose(other.control(t), one.control(t), rtol=0, atol=3e-9)
        np.testing.assert_allclose(other.delay(t), one.delay(t), rtol=0, atol=0)


def formation(law: AdaptiveDelayedFeedback, orbits: int) -> object:
    x0 = 20.0 / 6700.0
    loop = ClosedLoop(RelativeMotion(Chief(6700.0, gravitational_parameter_km3_s2=398600.5)), law)
    return MethodOfSteps(40).solve(loop, [x0, 0.0, 0.0, 0.0, -2.0 * x0, 0.0], orbits * TURN)


@pytest.mark.parametrize(("renewal", "rates"), [("per_orbit", [0.5, 1.0]), ("always", [1e4, 3e4])])
def test_the_delay_of_a_formation_becomes_the_leaders_period(renewal: str, rates: list[float]) -> None:
    """From τ₀ = 1.02 T; then neither control nor drift are left, as with τ = T."""
    law = AdaptiveDelayedFeedback(lqr(HCW(), 1.0, 1e3), [1.02 * TURN, 0.97 * TURN], rates, renewal)
    trajectory = formation(law, 60)
    np.testing.assert_allclose(trajectory.delay([59.0 * TURN])[:, 0], TURN, rtol=0, atol=1e-9)
    assert np.all(drift_per_orbit(trajectory) < 1e-8)
    assert np.all(np.linalg.norm(trajectory.control([59.0 * TURN]), axis=2) < 1e-12)
    assert np.all(periodicity_error(trajectory) < 1e-10)
    stubborn = formation(AdaptiveDelayedFeedback(lqr(HCW(), 1.0, 1e3), 1.02 * TURN, 0.0), 60)
    assert np.all(delta_v_per_orbit(trajectory) < 0.3 * delta_v_per_orbit(stubborn))
    assert drift_per_orbit(stubborn) > 0.1


@pytest.mark.parametrize(("renewal", "rate"), [("per_orbit", 0.2), ("always", 0.05)])
def test_the_delay_of_the_libration_becomes_two_pi(renewal: str, rate: float) -> None:
    """From 1.02 · 2π, adapted once the control has found the neighbourhood of an orbit."""
    law = AdaptiveDelayedFeedback([[0.0, 0.3]], 1.02 * TURN, rate, renewal, adapt_from=60.0 * TURN)
    trajectory = MethodOfSteps(40).solve(ClosedLoop(Libration(), law), [0.0, 1.0], 110.0 * TURN)
    found = trajectory.delay([60.0 * TURN, 110.0 * TURN]) - TURN
    assert found[0] == pytest.approx(0.02 * TURN, rel=1e-12)
    assert abs(found[1]) < 1e-4
    assert np.abs(trajectory.control([110.0 * TURN])).max() < 1e-4


def test_steps_end_where_the_motion_is_not_smooth() -> None:
    """With every jump on the end of a step the error falls by 2⁸ from N to 2N, 2⁶ at the least; without by 2³."""
    law = AdaptiveDelayedFeedback([[0.1, 0.3]], 5.0, 0.3, "per_orbit")
    loop, t = ClosedLoop(Libration(eccentricity=0.05), law), np.linspace(0.0, 30.0, 40)
    runs = {n: MethodOfSteps(n).solve(loop, [0.0, 0.3], 30.0) for n in (16, 32, 128)}
    errors = [np.abs(runs[n](t) - runs[128](t)).max() for n in (16, 32)]
    assert errors[1] < errors[0] / 64.0
    assert errors[1] < 1e-8
    assert runs[32].error_estimate[0] > 0.1 * errors[1]


def test_a_delay_that_is_lost_ends_the_member() -> None:
    law = AdaptiveDelayedFeedback(np.zeros((2, 2)), 2.0, [0.0, 50.0], "per_orbit")
    trajectory = MethodOfSteps(20).solve(ClosedLoop(KNOWN, law), [0.0, 1.0], 20.0)
    assert list(trajectory.status) == ["ok", "diverged"]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: AdaptiveDelayedFeedback([[0.0, 1.0]], 1.0, -0.1), "`rate` must not be negative"),
        (lambda: AdaptiveDelayedFeedback([[0.0, 1.0]], 1.0, 0.1, "often"), "`renewal` must be 'always' or 'per_orbit'"),
        (lambda: AdaptiveDelayedFeedback([[0.0, 1.0]], 1.0, adapt_from=0.5), "`adapt_from` must not lie before the"),
        (
            lambda: ClosedLoop(Libration(), AdaptiveDelayedFeedback([[0.0, 1.0]], [1.0, 2.0], [0.1, 0.2, 0.3])),
            r"`rate` must have the shape of `delay`, \(2,\)",
        ),
    ],
)
def test_bad_input_is_refused_in_sentences(make: object, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()


def test_free_motion_has_no_delay() -> None:
    free = MethodOfSteps(10).solve(ClosedLoop(Libration()), [0.0, 1.0], 1.0)
    with pytest.raises(UnsupportedError, match="a free motion has no delay"):
        free.delay([0.5])
