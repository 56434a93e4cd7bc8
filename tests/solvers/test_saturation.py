"""Saturated delayed feedback against an integrator that solves one delay after the other, and closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fracctl.controllers import DelayedFeedback, DelayedSum, PDAlpha, Saturation
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.measures import delta_v
from fracctl.plants import FunctionPlant, HCWOutOfPlane, Libration, RelativeMotion, RotatingEllipsoid
from fracctl.solvers import MethodOfSteps, solve
from tests.solvers.test_method_of_steps import PAPER, rotation_gain

GAIN, TAU, START = rotation_gain(*PAPER), 3.10656, np.array([0.0, 1.0, 1.9, 0.0])
ORBITS = 5
CLIPS = {
    "norm": lambda w, top: w * min(1.0, top / max(np.hypot(*w), 1e-300)),
    "axis": lambda w, top: np.clip(w, -top, top),
}


def one_delay_after_the_other(clip: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, float]:
    """The state and the ΔV after some orbits about Eros; each piece sees the dense output of the one before."""
    plant, pieces = RotatingEllipsoid(), []

    def control(t: float, x: np.ndarray) -> np.ndarray:
        return np.zeros(2) if len(pieces) < 1 else clip(-GAIN @ (x - pieces[-1](t - TAU)[:4]))

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        u = control(t, y[:4])
        return np.append(plant.rates(np.array([t]), y[None, :4], u[None])[0], np.hypot(*u))

    y = np.append(START, 0.0)
    for k in range(ORBITS + 1):
        run = solve_ivp(
            rates, (k * TAU, (k + 1) * TAU), y, "DOP853", rtol=1e-11, atol=1e-12, dense_output=True, max_step=0.02
        )
        y, _ = run.y[:, -1], pieces.append(run.sol)
    return y[:4], float(y[4])


@pytest.mark.parametrize("by", ["norm", "axis"])
def test_limits_in_the_loop(by: str) -> None:
    """Two limits in one batch over five controlled orbits; 400 steps are far better than 100."""
    limits, horizon = np.array([0.002, 0.004]), (ORBITS + 1) * TAU
    given = limits if by == "norm" else limits[:, None]
    loop = ClosedLoop(RotatingEllipsoid(), DelayedFeedback(GAIN, TAU), Saturation(given, by))
    fine = MethodOfSteps(400).solve(loop, START, horizon)
    rough = MethodOfSteps(100).solve(loop, START, horizon)
    for i, limit in enumerate(limits):
        state, spent = one_delay_after_the_other(lambda w, top=limit: CLIPS[by](w, top))
        np.testing.assert_allclose(fine([horizon])[i, 0], state, rtol=0, atol=5e-6)
        np.testing.assert_allclose(rough([horizon])[i, 0], state, rtol=0, atol=1e-4)
        assert np.abs(rough([horizon])[i, 0] - state).max() < 10.0 * rough.error_estimate[i]
        assert delta_v(fine)[i] == pytest.approx(spent, rel=1e-5)
    shown = fine.controls
    size = np.linalg.norm(shown, axis=2) if by == "norm" else np.abs(shown).max(axis=2)
    np.testing.assert_allclose(size.max(axis=1), limits, rtol=1e-12)
    assert np.linalg.norm(fine.demand(fine.times), axis=2).max() > 1.5 * limits.min()


@pytest.mark.parametrize("by", ["norm", "axis"])
@pytest.mark.parametrize("second", [False, True])
def test_wide_limits_change_nothing(by: str, second: bool) -> None:
    law = DelayedFeedback(GAIN, TAU)
    law = DelayedSum(law, DelayedFeedback(GAIN, 2.0)) if second else law
    free = MethodOfSteps(40).solve(ClosedLoop(RotatingEllipsoid(), law), START, 9.0)
    wide = MethodOfSteps(40).solve(ClosedLoop(RotatingEllipsoid(), law, Saturation(1e3, by)), START, 9.0)
    np.testing.assert_array_equal(wide.states, free.states)
    np.testing.assert_array_equal(wide.controls, free.controls)
    np.testing.assert_array_equal(delta_v(wide), delta_v(free))


def wave(gain: list[list[float]], saturation: Saturation | None, steps: int) -> float:
    """ΔV over 3 periods of x = (sin t, 0) whatever is done; w = -A K₁ cos(t - ½) with A = 2 sin ½."""
    m = len(gain)
    plant = FunctionPlant(lambda t, x, u: np.stack([np.cos(t), 0.0 * t], 1), 2, m)
    law = DelayedFeedback(gain, 1.0)
    trajectory = MethodOfSteps(steps).solve(ClosedLoop(plant, law, saturation), [0.0, 0.0], 1.0 + 6.0 * np.pi)
    return delta_v(trajectory, 1.0)


def cut_sine(amplitude: float, limit: float) -> float:
    """∫ min(|a sin|, L) over a period: 4 [a (1 - cos θ) + L (π/2 - θ)], θ = asin(L/a)."""
    theta = np.arcsin(min(limit / amplitude, 1.0))
    return 4.0 * (amplitude * (1.0 - np.cos(theta)) + limit * (0.5 * np.pi - theta))


@pytest.mark.parametrize("limit", [1e9, 0.9, 0.31, 0.01])
@pytest.mark.parametrize("steps", [10, 37])
def test_kinks_are_cut_out(limit: float, steps: int) -> None:
    """One control, by either limit; two equal ones, by axis; to 1e-10 of the whole with steps of a 37th."""
    a, rtol = 2.0 * np.sin(0.5), 1e-7 if steps == 10 else 1e-10
    for by in ("norm", "axis"):
        found = wave([[1.0, 0.0]], Saturation(limit, by), steps)
        assert found == pytest.approx(3.0 * cut_sine(a, limit), rel=rtol)
    both = wave([[1.0, 0.0], [-1.0, 0.0]], Saturation(limit, "axis"), steps)
    assert both == pytest.approx(3.0 * np.sqrt(2.0) * cut_sine(a, limit), rel=rtol)
    assert wave([[1.0, 0.0]], None, steps) == pytest.approx(12.0 * a, rel=rtol)


def test_each_axis_can_have_its_own_limit() -> None:
    demand = np.array([[[3.0, -4.0], [0.1, 0.2]]])
    for limit in ([1.0, 2.0], [[1.0, 2.0]]):
        np.testing.assert_array_equal(Saturation(limit, "axis")(demand), [[[1.0, -2.0], [0.1, 0.2]]])
        assert Saturation(limit, "axis").batch is None
    members = Saturation([[1.0], [2.0]], "axis")
    np.testing.assert_array_equal(members(np.repeat(demand, 2, axis=0))[:, 0], [[1.0, -1.0], [2.0, -2.0]])
    assert members.batch == 2
    np.testing.assert_array_equal(members.take(np.array([1]))(demand)[0, 0], [2.0, -2.0])
    np.testing.assert_allclose(Saturation(1.0)(demand), [[[0.6, -0.8], [0.1, 0.2]]], rtol=1e-15)
    assert Saturation([1.0, 2.0]).batch == 2


def test_limits_by_axis_of_one_loop_are_no_batch() -> None:
    law = PDAlpha(np.eye(3), np.eye(3), 0.9)
    loop = ClosedLoop(RelativeMotion(), law, Saturation([1e-3, 2e-3, 3e-3], "axis"))
    assert loop.batch is None
    trajectory = solve(loop, [0.1, 0.2, 0.3, 0.0, 0.0, 0.0], 0.5, "explicit_memory")
    np.testing.assert_allclose(np.abs(trajectory.control([0.1])), [[1e-3, 2e-3, 3e-3]])


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Saturation(0.0), "`limit` must be positive, but is 0.0"),
        (lambda: Saturation(1.0, "component"), "`by` must be 'norm' or 'axis', but is 'component'"),
        (lambda: Saturation([[1.0, 1.0]]), r"`limit` must have shape \(\) or \(b,\), but is of shape \(1, 2\)"),
        (
            lambda: ClosedLoop(Libration(), None, Saturation([[1.0, 2.0]], "axis")),
            r"`limit` must have shape \(\) or \(b, 1\) for this plant, but is of shape \(1, 2\)",
        ),
        (
            lambda: ClosedLoop(RotatingEllipsoid(), None, Saturation([1.0, 2.0, 3.0], "axis")),
            r"`limit` must have shape \(\), \(2,\), \(b, 1\) or \(b, 2\) for this plant, but is of shape \(1, 3\)",
        ),
        (
            lambda: ClosedLoop(RotatingEllipsoid(), DelayedFeedback([GAIN] * 3, TAU), Saturation([1.0, 2.0])),
            "must have one batch size with the plant and the limits, but is in a loop of batches of 2 and 3",
        ),
    ],
)
def test_bad_input_is_refused_in_sentences(make: object, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()


def test_solvers_of_linear_loops_refuse_it() -> None:
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91), Saturation(1.0))
    with pytest.raises(UnsupportedError, match="this one has a saturated control"):
        solve(loop, np.zeros(2), 1.0)
