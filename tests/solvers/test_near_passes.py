"""Steps of members' own where the motion is fast, against Taylor series in arbitrary precision and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fracctl.controllers import AdaptiveDelayedFeedback, DelayedFeedback, DelayedSum, Saturation
from fracctl.controllers.delayed_feedback import DelayedLaw
from fracctl.loop import ClosedLoop
from fracctl.plants import FunctionPlant, RotatingEllipsoid
from fracctl.solvers import MethodOfSteps, dop853
from tests.references import ellipsoid

SMALL = np.array([[0.0155, -0.0579, 0.0123, 0.0126], [0.0579, 0.0155, -0.0126, 0.0123]])
"""Gain that holds orbits about Eros with ρ = 1.632 to 1.9."""
FALL, LEAVE = 10.838512443327032, 54.29239157456274
"""When ρ = 1.6 collides and ρ = 1.632 escapes, by `ellipsoid.end`."""
SEVENTY_HOURS = 83.45


def start(rho: float) -> list[float]:
    return [0.0, 1.0, rho, 0.0]


@pytest.mark.parametrize(("rho", "time"), [(1.6, FALL), pytest.param(1.632, LEAVE, marks=pytest.mark.slow)])
def test_the_times_are_those_of_a_taylor_series(rho: float, time: float) -> None:
    assert float(ellipsoid.end(start(rho))) == pytest.approx(time, abs=1e-13)


@pytest.mark.parametrize("steps", [20, 100, 400])
def test_near_passes_of_eros(steps: int) -> None:
    """Even steps jump over the body from ρ = 1.6 and report an escape, and let 1.632 escape at 59."""
    trajectory = MethodOfSteps(steps).solve(ClosedLoop(RotatingEllipsoid()), [start(1.6), start(1.632)], SEVENTY_HOURS)
    assert list(trajectory.status) == ["collision", "escaped"]
    np.testing.assert_allclose(trajectory.end, [FALL, LEAVE], rtol=0, atol=1e-6)
    assert trajectory.events["collision"][0] == trajectory.end[0]
    assert np.isnan(trajectory.events["escaped"][0])
    assert np.isnan(trajectory.events["collision"][1])
    radii = np.hypot(*np.moveaxis(trajectory(np.nextafter(trajectory.end, 0.0)[:, None])[:, 0, :2], -1, 0))
    np.testing.assert_allclose(radii, [0.02, 5.0], rtol=1e-9)
    assert (trajectory.error_estimate < 5e-6).all()


def test_members_that_need_no_steps_of_their_own_keep_theirs() -> None:
    """The same bits, whoever is in the batch; `times` are then each member's own."""
    loop, horizon = ClosedLoop(RotatingEllipsoid()), 40.0
    t = np.linspace(0.0, horizon, 301)
    alone = MethodOfSteps().solve(loop, [start(1.9), start(2.3)], horizon)
    among = MethodOfSteps().solve(loop, [start(1.9), start(1.6), start(2.3)], horizon)
    assert alone.times.ndim == 1
    assert among.times.shape[0] == 3
    np.testing.assert_array_equal(among(t)[::2], alone(t))
    np.testing.assert_array_equal(among.end[::2], alone.end)
    np.testing.assert_array_equal(among.error_estimate[::2], alone.error_estimate)
    np.testing.assert_array_equal(among.counters["steps"][::2], alone.counters["steps"])
    assert list(among.status) == ["ok", "collision", "escaped"]


def fed_back(gain: np.ndarray, delay: float, rho: float, count: int, recall: float) -> list[object]:
    """States of delayed feedback on `count` delays by another integrator, delay by delay."""
    plant, pieces, references = RotatingEllipsoid(), [], []
    for k in range(count):

        def reference(t: float, k: int = k) -> np.ndarray:
            past = pieces[k - 1](t - delay)
            return past if k == 1 else (1.0 - recall) * past + recall * references[k - 1](t - delay)

        def rates(t: float, x: np.ndarray, k: int = k) -> np.ndarray:
            control = -gain @ (x - references[k](t)) if k else np.zeros(2)
            return plant.rates(np.zeros(1), x[None], control[None])[0]

        references.append(reference)
        first = pieces[-1](k * delay) if k else start(rho)
        span = (k * delay, (k + 1) * delay)
        pieces.append(solve_ivp(rates, span, first, method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True).sol)
    return pieces


@pytest.mark.parametrize("recall", [0.0, 0.5])
@pytest.mark.parametrize("summed", [False, True])
def test_near_passes_under_delayed_feedback(recall: float, summed: bool) -> None:
    """ρ = 1.632 with N = 16 misses 1e-6 by far; the breaking points remain ends of steps."""
    delay, count = 3.06311, 4
    law: DelayedLaw = DelayedFeedback(SMALL, delay, recall=recall)
    law = DelayedSum(law, DelayedFeedback(np.zeros((2, 4)), 2.0)) if summed else law
    trajectory = MethodOfSteps(16).solve(ClosedLoop(RotatingEllipsoid(), law), start(1.632), count * delay)
    pieces = fed_back(SMALL, delay, 1.632, count, recall)
    t = np.linspace(0.01, 0.99, 25)
    for k, piece in enumerate(pieces):
        np.testing.assert_allclose(trajectory((k + t) * delay), piece((k + t) * delay).T, rtol=0, atol=1e-8)
    assert trajectory.error_estimate[0] < 1e-9
    for k in range(1, count):
        assert np.abs(trajectory.times - k * delay).min() < 1e-13


def test_members_with_their_own_gains_schedules_and_histories() -> None:
    """x' = y, y' = -x (x² + y²)^(-3/2) passes the centre at 0.02; one member of three is refined."""

    def gain(times: np.ndarray) -> np.ndarray:
        scale = np.array([0.0, 0.1, 0.2])[:, None]
        return (scale * np.cos(times))[..., None, None] * np.array([[0.3, 0.1, 0.0, 0.2], [0.0, 0.3, 0.2, 0.1]])

    def past(times: np.ndarray) -> np.ndarray:
        own = np.stack([np.ones((3, times.shape[1])), 0.1 * times, 0.2 + 0.0 * times, 0.1 + 0.0 * times], axis=-1)
        return own * np.array([1.0, 1.1, 1.2])[:, None, None]

    def attraction(t: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.concatenate([x[:, 2:], -x[:, :2] / np.hypot(x[:, :1], x[:, 1:2]) ** 3 + u], axis=1)

    loop = ClosedLoop(FunctionPlant(attraction, 4, 2), DelayedFeedback(gain, [1.0, 1.1, 1.2], 0.0, history=past))
    starts = [[1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.2], [1.0, 0.0, 0.0, 1.1]]
    rough, fine = (MethodOfSteps(n).solve(loop, starts, 5.0) for n in (40, 1500))
    assert rough.counters["steps"][1] > 1.5 * rough.counters["steps"][0]
    np.testing.assert_allclose(rough.states, fine(rough.times), rtol=0, atol=1e-7)


def test_a_solution_that_ends_is_followed_to_its_end() -> None:
    """x' = x² from 1 is 1/(1 - t)."""
    blow_up = FunctionPlant(lambda t, x, u: x**2, 1, 1)
    trajectory = MethodOfSteps(16).solve(ClosedLoop(blow_up), [1.0], 3.0)
    assert list(trajectory.status) == ["diverged"]
    assert trajectory.end[0] == pytest.approx(1.0, abs=1e-12)
    t = np.array([0.5, 0.9, 0.99, 0.999])
    np.testing.assert_allclose(trajectory(t)[:, 0], 1.0 / (1.0 - t), rtol=1e-10)


@pytest.mark.parametrize("kind", ["saturated", "adaptive"])
def test_what_lies_behind_a_jump_is_not_reported(kind: str) -> None:
    """Where steps are not refined, ρ = 1.6 without control ends before the step that jumps over the body."""
    law, zero = DelayedFeedback(0.0 * SMALL, 4.32157), np.zeros_like(SMALL)
    adaptive = AdaptiveDelayedFeedback(zero, 4.32157, rate=0.0) if kind == "adaptive" else law
    loop = ClosedLoop(RotatingEllipsoid(), adaptive, Saturation(1.0) if kind == "saturated" else None)
    trajectory = MethodOfSteps().solve(loop, start(1.6), 20.0)
    assert list(trajectory.status) == ["diverged"]
    assert 10.6 < trajectory.end[0] < FALL
    assert np.isnan(trajectory.events["escaped"][0])
    assert trajectory.events["body_entry"][0] == pytest.approx(0.779, abs=1e-3)


def test_rest_at_zero_is_no_jump() -> None:
    """x' = 0 until 1, then a growth that no doubles follow; a saturation forbids steps of its own."""
    plant = FunctionPlant(lambda t, x, u: np.where(t < 1.0, 0.0, 9.0 * x.T + np.sin(40.0 * t)).T, 1, 1)
    loop = ClosedLoop(plant, DelayedFeedback([[0.0]], 1.0), Saturation(1.0))
    trajectory = MethodOfSteps(20).solve(loop, [0.0], 5.0)
    assert trajectory.error_estimate[0] > 1e-3
    assert list(trajectory.status) == ["ok"]


def test_the_embedded_estimate_is_of_order_eight() -> None:
    """x' = x from 1: halving a step divides the estimate by 2⁸, and it is not below the error."""
    estimates = []
    for h in (0.4, 0.2):
        values = np.empty((dop853.STAGES + 1, 1))
        values[0] = 1.0
        for s in range(dop853.STAGES):
            values[s + 1] = h * (dop853.COMBINE[s, : s + 1] @ values[: s + 1])
        estimates.append(float(dop853.local_error(values, np.ones((1, 1)))[0]))
        error = abs(float((dop853.COMBINE[dop853.END] @ values)[0]) - np.exp(h))
        assert error < estimates[-1] < 1e4 * error + 1e-14
    assert np.log2(estimates[0] / estimates[1]) == pytest.approx(8.0, abs=0.7)
