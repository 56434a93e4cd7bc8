"""The method of steps against closed forms, Taylor series in arbitrary precision, and published outcomes."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fracctl.controllers import DelayedFeedback, DelayedSum, PDAlpha
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.plants import (
    Event,
    FunctionPlant,
    HCWInPlane,
    HCWOutOfPlane,
    Libration,
    LinearPlant,
    RotatingEllipsoid,
)
from fracctl.solvers import Contour, MethodOfSteps, solve
from fracctl.solvers.dop853 import COMBINE, NODES, basis
from tests.references import delays

TURN = 2.0 * np.pi
ONE = Fraction(1)
TENTH = Fraction(1, 10)
STIFFNESS, DAMPING = -1.7, -0.2
MATRIX = [[0.0, 1.0], [STIFFNESS, DAMPING]]
GAIN = [[0.3, -0.4]]
PAPER = np.array([0.0525, -0.1243, 0.1169, 0.0373])
"""Gains (a, b, c, d) of [aI + bJ | cI + dJ] that hold orbits about Eros with ρ = 1.75 to 2.3."""


def decay(**law: object) -> ClosedLoop:
    """u' = -u(t - 1)."""
    plant = FunctionPlant(lambda t, x, u: u - x, 1, 1)
    return ClosedLoop(plant, DelayedFeedback([[-1.0]], 1.0, 0.0, **{"history": 1.0, **law}))


def rotation_gain(a: float, b: float, c: float, d: float) -> np.ndarray:
    return np.array([[a, b, c, d], [-b, a, -d, c]])


def in_state_space(terms: list[delays.Term]) -> list[delays.Term]:
    """Terms of ξ'' = … + υ as those of x' = … + Bυ."""
    return [delays.Term([[0.0, 0.0], list(t.gain[0])], t.delay, t.switch_on, t.recall) for t in terms]


def test_the_textbook_equation() -> None:
    """u' = -u(t-1), u = 1 before: u(5) = 19/120 and u(10) = 10493/518400."""
    trajectory = solve(decay(), [1.0], 10.0, solver="method_of_steps")
    np.testing.assert_allclose(trajectory([5.0, 10.0])[:, 0], [19 / 120, 10493 / 518400], rtol=0, atol=1e-12)
    np.testing.assert_allclose(trajectory([0.25, 0.5, 1.5])[:, 0], [0.75, 0.5, -0.5 + 0.125], rtol=0, atol=1e-14)
    assert list(trajectory.status) == ["ok"]
    assert trajectory.error_estimate.shape == (1,)
    np.testing.assert_allclose(trajectory.control([0.0, 0.5, 1.5])[:, 0], [0.0, -0.5, -0.375 - 0.5], atol=1e-14)


@pytest.mark.parametrize("steps", [8, 13, 40])
def test_jumps_of_the_history_are_tracked(steps: int) -> None:
    """The history is 0.3 before -0.4 and -2 after; the state jumps from -2 to 1 at time 0."""

    def past(times: np.ndarray) -> np.ndarray:
        return np.where(times < -0.4, 0.3, -2.0)[..., None]

    times = [Fraction(k, 40) for k in range(1, 241)]
    exact = delays.linear(
        [[-1.0]],
        [delays.Term([[-1.0]], ONE)],
        lambda t: [0.3 if t < Fraction(-2, 5) else -2.0],
        [1.0],
        Fraction(1, 5),
        times,
    )
    loop = decay(history=past, history_breaks=[-0.4])
    trajectory = MethodOfSteps(steps).solve(loop, [1.0], 6.0)
    np.testing.assert_allclose(
        trajectory([float(t) for t in times]), exact, rtol=0, atol=2e-11 if steps < 20 else 1e-14
    )


@pytest.mark.parametrize("switch_on", [ONE, 2 * ONE, Fraction(13, 10), Fraction(37, 10)])
@pytest.mark.parametrize("recall", [0.0, 0.6])
def test_an_oscillator_agrees_with_taylor_series(switch_on: Fraction, recall: float) -> None:
    """From a free motion, with and without recall, where control begins on and between multiples of the delay."""
    start, times = [0.4, -0.9], [Fraction(k, 20) for k in range(1, 161)]
    free = delays.linear(MATRIX, [], lambda t: [], start, TENTH, times)
    law = DelayedFeedback(GAIN, 1.0, float(switch_on), recall=recall)
    trajectory = MethodOfSteps(40).solve(ClosedLoop(LinearPlant(STIFFNESS, DAMPING), law), start, 8.0)
    terms = in_state_space([delays.Term(GAIN, ONE, switch_on, recall)])
    exact = delays.linear(MATRIX, terms, lambda t: [0.0, 0.0], start, TENTH, times, reference_from=ONE)
    early = np.array([t <= switch_on for t in times])
    np.testing.assert_allclose(exact[early], free[early], rtol=0, atol=1e-15)
    np.testing.assert_allclose(trajectory([float(t) for t in times]), exact, rtol=0, atol=2e-13)
    assert np.abs(exact[-1] - free[-1]).max() > 0.05


def test_several_delays_are_looked_up() -> None:
    """Delays 1 and 0.7 with jumps in the history of both; the members of the batch differ in gains."""

    def past(times: np.ndarray) -> np.ndarray:
        return np.broadcast_to([0.2, -0.5], (*times.shape, 2))

    start, times = [0.4, -0.9], [Fraction(k, 20) for k in range(1, 101)]
    second = [[-0.2, 0.3]]
    first = DelayedFeedback([GAIN, np.zeros((1, 2))], 1.0, 0.5, history=past)
    law = DelayedSum(first, DelayedFeedback(second, 0.7))
    trajectory = MethodOfSteps(40).solve(ClosedLoop(LinearPlant(STIFFNESS, DAMPING), law), start, 5.0)
    for i, gain in enumerate((GAIN, [[0.0, 0.0]])):
        terms = [
            delays.Term(gain, ONE, Fraction(1, 2)),
            delays.Term(second, Fraction(7, 10), Fraction(7, 10)),
        ]
        exact = delays.linear(MATRIX, in_state_space(terms), lambda t: [0.2, -0.5], start, TENTH, times)
        np.testing.assert_allclose(trajectory([float(t) for t in times])[i], exact, rtol=0, atol=1e-12)


def test_looking_up_agrees_with_the_grid() -> None:
    """A sum with a second law of gain zero is one law, but its delayed states are looked up."""
    plant, start = Libration(), [0.1, 0.4]
    for law in (DelayedFeedback([[0.1, 0.3]], 2.1, 3.0), DelayedFeedback([[0.1, 0.3]], 2.1, recall=0.5)):
        one = MethodOfSteps(50).solve(ClosedLoop(plant, law), start, 15.0)
        other = DelayedSum(law, DelayedFeedback([[0.0, 0.0]], 1.3))
        two = MethodOfSteps(50).solve(ClosedLoop(plant, other), start, 15.0)
        t = np.linspace(0.0, 15.0, 77)
        np.testing.assert_allclose(two(t), one(t), rtol=0, atol=2e-10)
        np.testing.assert_allclose(two.control(t), one.control(t), rtol=0, atol=2e-10)


@pytest.mark.parametrize("case", ["no memory", "delayed", "looked up"])
def test_order_is_eight(case: str) -> None:
    """x = e^{λt} solves x' = A x - k (x - x(t-τ)) with A = λ + k (1 - e^{-λτ}); the last two points of a fit."""
    rate, gain, delay = complex(-0.05, 1.3), 0.6, 2.0 * np.pi
    a = rate + gain * (1.0 - np.exp(-rate * delay)) * (case != "no memory")
    matrix = np.array([[a.real, -a.imag], [a.imag, a.real]])
    plant = FunctionPlant(lambda t, x, u: x @ matrix.T + u, 2, 2, smooth=True)

    def wave(times: np.ndarray) -> np.ndarray:
        z = np.exp(rate * times)
        return np.stack([z.real, z.imag], axis=-1)

    law = DelayedFeedback(gain * np.eye(2), delay, 0.0, history=wave)
    laws = {"no memory": None, "delayed": law, "looked up": DelayedSum(law, DelayedFeedback(np.zeros((2, 2)), delay))}
    loop, horizon, errors = ClosedLoop(plant, laws[case]), 6.0 * np.pi, []
    counts = np.array([32, 48])
    for count in counts:
        trajectory = MethodOfSteps(int(count)).solve(loop, [1.0, 0.0], horizon)
        at = np.array([horizon])
        errors.append(np.abs(trajectory(at) - wave(at)).max())
        assert trajectory.error_estimate[0] >= 0.3 * errors[-1]
    order = np.log(errors[0] / errors[1]) / np.log(counts[1] / counts[0])
    assert order == pytest.approx(8.0, abs=0.25)


def test_stages_and_extension_meet_their_order_conditions() -> None:
    """Σ_j a_ij = c_i; the extension reproduces polynomials of degree seven from their slopes."""
    np.testing.assert_allclose(COMBINE[:, 1:].sum(axis=1), NODES, atol=1e-13)
    plant = FunctionPlant(lambda t, x, u: 7.0 * (t[:, None] - 0.3) ** 6 + 0.0 * x, 1, 1, smooth=True)
    trajectory = MethodOfSteps(8).solve(ClosedLoop(plant), [0.0], 2.0)
    t = np.linspace(0.0, 2.0, 33)
    np.testing.assert_allclose(trajectory(t)[:, 0], (t - 0.3) ** 7 + 0.3**7, atol=1e-12)
    np.testing.assert_allclose(basis(np.array([0.0, 1.0])), [[1, 0, 0, 0, 0, 0, 0, 0], [1, 1, 0, 0, 0, 0, 0, 0]])


def test_members_with_their_own_delays_gains_and_states() -> None:
    rng = np.random.default_rng(4)
    gains, taus = rng.normal(size=(4, 1, 2)) * 0.3, np.array([1.0, 2.3, 0.7, 2.0 * np.pi])
    starts, begin = rng.normal(size=(4, 2)), taus * [1.0, 1.37, 2.0, 1.1]
    whole = MethodOfSteps(30).solve(ClosedLoop(Libration(), DelayedFeedback(gains, taus, begin)), starts, 9.0)
    t = np.linspace(0.0, 9.0, 50)
    assert whole.times.shape[0] == 4
    assert whole.states.shape == (*whole.times.shape, 2)
    for i in range(4):
        loop = ClosedLoop(Libration(), DelayedFeedback(gains[i], taus[i], begin[i]))
        single = MethodOfSteps(30).solve(loop, starts[i], 9.0)
        np.testing.assert_allclose(whole(t)[i], single(t), rtol=0, atol=1e-11)
        np.testing.assert_allclose(whole.control(t)[i], single.control(t), rtol=0, atol=1e-11)
        np.testing.assert_array_equal(single.control(t[t < begin[i]]), 0.0)
        own = np.linspace(0.0, 9.0, 4)[:, None] * np.ones(3)
        np.testing.assert_array_equal(whole(own)[i], whole(own[i])[i])


def test_a_gain_that_depends_on_time() -> None:
    """x' = 0.2 x - k(t) (x - x(t-1)) by another integrator, delay by delay; looked up too."""

    def gain(times: np.ndarray) -> np.ndarray:
        return (0.5 + 0.8 * np.cos(TURN * times))[..., None, None]

    pieces, exact = [lambda t: np.exp(0.2 * t)], []
    for k in range(1, 5):

        def rates(t: float, x: np.ndarray) -> np.ndarray:
            return 0.2 * x - gain(np.array(t))[0, 0] * (x - pieces[-1](t - 1.0))

        first = [pieces[-1](float(k)).item()]
        run = solve_ivp(rates, (k, k + 1.0), first, method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
        pieces.append(run.sol)
        exact.append(run.sol(k + 0.5).item())
    plant, law = FunctionPlant(lambda t, x, u: 0.2 * x + u, 1, 1), DelayedFeedback(gain, 1.0)
    t = np.arange(1, 5) + 0.5
    for given in (law, DelayedSum(law, DelayedFeedback([[0.0]], 0.7))):
        run = MethodOfSteps(40).solve(ClosedLoop(plant, given), [1.0], 5.0)
        np.testing.assert_allclose(run(t)[:, 0], exact, atol=1e-10)
        expected = -gain(t)[:, 0, 0] * (run(t) - run(t - 1.0))[:, 0]
        np.testing.assert_allclose(run.control(t)[:, 0], expected, atol=1e-12)


def test_members_with_a_gain_that_depends_on_time_are_switched_on_one_by_one() -> None:
    def gain(times: np.ndarray) -> np.ndarray:
        return np.stack([0.1 * np.cos(times), 0.3 + 0.1 * np.sin(times)], axis=-1)[..., None, :]

    t, begin = np.linspace(0.0, 25.0, 60), np.array([TURN, 1.37 * TURN, 2.0 * TURN])
    whole = MethodOfSteps(30).solve(ClosedLoop(Libration(), DelayedFeedback(gain, TURN, begin)), [0.2, 0.9], 25.0)
    for i, start in enumerate(begin):
        single = MethodOfSteps(30).solve(ClosedLoop(Libration(), DelayedFeedback(gain, TURN, start)), [0.2, 0.9], 25.0)
        np.testing.assert_allclose(whole(t)[i], single(t), rtol=0, atol=1e-6)
        np.testing.assert_array_equal(whole.control(t[t < start])[i], 0.0)
    free = MethodOfSteps(30).solve(ClosedLoop(Libration()), [0.2, 0.9], 25.0)
    np.testing.assert_allclose(whole(begin[:, None])[:, 0], free(begin), rtol=0, atol=1e-6)


def test_without_delay_there_is_no_control() -> None:
    plant, start, t = Libration(), [0.2, 1.0], np.linspace(0.05, 1.0, 20)
    free = MethodOfSteps().solve(ClosedLoop(plant), start, 1.0)
    sizes = []
    for tau in (1e-2, 5e-3):
        controlled = MethodOfSteps(8).solve(ClosedLoop(plant, DelayedFeedback([[0.0, 1.0]], tau)), start, 1.0)
        sizes.append(np.abs(controlled.control(t)).max())
        assert np.abs(controlled(t) - free(t)).max() < 5.0 * tau
    assert sizes[1] == pytest.approx(0.5 * sizes[0], rel=0.05)


def test_free_motion_of_a_linear_plant_is_the_same_for_all_solvers() -> None:
    loop, start, t = ClosedLoop(HCWInPlane()), [1e-3, -2e-3, 0.5e-3, 1e-3], np.linspace(0.0, 12.0, 30)
    stepped = MethodOfSteps().solve(loop, start, 12.0)
    np.testing.assert_allclose(stepped(t), Contour().solve(loop, start, 12.0)(t), rtol=0, atol=1e-9 * 0.1)


def test_controlled_libration_settles_on_an_orbit_of_period_two_pi() -> None:
    """k = 0.30: error and control below 1e-6 after 200 periods, φ within about ±1.2 of some multiple of π."""
    law = DelayedFeedback([[0.0, 0.3]], 2.0 * np.pi)
    trajectory = MethodOfSteps(40).solve(ClosedLoop(Libration(), law), [0.0, 1.0], 400.0 * np.pi)
    t = np.linspace(398.0, 400.0, 201) * np.pi
    states = trajectory(t)
    assert np.abs(states - trajectory(t - 2.0 * np.pi)).max() < 1e-6
    assert np.abs(trajectory.control(t)).max() < 1e-6
    about = np.pi * np.round(states[:, 0].mean() / np.pi)
    assert np.abs(states[:, 0] - about).max() == pytest.approx(1.2, abs=0.1)


def test_uncontrolled_outcomes_about_eros() -> None:
    """Over 70 h: 1.632, 1.75 and 2.3 escape, 1.65, 1.7, 1.9, 2.2 stay; all enter the body at t ≈ 0.75 below 2."""
    rho = np.array([1.632, 1.65, 1.7, 1.75, 1.9, 2.2, 2.3])
    starts = np.stack([0 * rho, 1 + 0 * rho, rho, 0 * rho], axis=1)
    trajectory = MethodOfSteps(200).solve(ClosedLoop(RotatingEllipsoid()), starts, 83.45)
    assert list(trajectory.status) == ["escaped", "ok", "ok", "escaped", "ok", "ok", "escaped"]
    np.testing.assert_allclose(trajectory.events["body_entry"][:5], 0.75, atol=0.1)
    assert np.isnan(trajectory.events["collision"]).all()
    assert np.isnan(trajectory([83.0])[0]).all()
    escaped = trajectory(trajectory.end[:, None])[0, 0]
    assert np.hypot(*escaped[:2]) == pytest.approx(5.0, abs=1e-9)
    surface = MethodOfSteps().solve(ClosedLoop(RotatingEllipsoid(collision="body")), starts[4], 10.0)
    assert list(surface.status) == ["body_entry"]
    assert surface.end[0] == pytest.approx(trajectory.events["body_entry"][4], abs=1e-6)


def test_controlled_orbit_about_eros() -> None:
    """ρ = 1.9, τ = 3.10656: errors fall as 2e-6, 5e-9, 1e-11 for N = 20, 40, 80 over 20 orbits, and u → 0."""
    tau, t = 3.10656, 3.10656 * np.linspace(0.0, 20.0, 101)
    loop = ClosedLoop(RotatingEllipsoid(), DelayedFeedback(rotation_gain(*PAPER), tau))
    runs = {n: MethodOfSteps(n).solve(loop, [0.0, 1.0, 1.9, 0.0], 20.0 * tau) for n in (20, 40, 80, 160)}
    for n, bound in ((20, 1e-5), (40, 2e-8), (80, 5e-11)):
        assert np.abs(runs[n](t) - runs[160](t)).max() < min(bound, runs[n].error_estimate[0] * 3.0)
    controls = np.abs(runs[80].control(t)).max(axis=1)
    assert controls[-5:].max() < 0.02 * controls.max()


def test_events_of_a_user_and_divergence() -> None:
    falls = Event("ground", lambda t, x: x[:, 0], terminal=True)
    passes = Event("noon", lambda t, x: 0.5 - t, terminal=False)
    ball = FunctionPlant(lambda t, x, u: np.stack([x[:, 1], -2.0 + 0.0 * x[:, 1]], 1), 2, 1, events=[falls, passes])
    trajectory = MethodOfSteps().solve(ClosedLoop(ball), [[1.0, 0.0], [16.0, 0.0]], 3.0)
    np.testing.assert_allclose(trajectory.end, [1.0, 3.0], atol=1e-13)
    np.testing.assert_allclose(trajectory.events["noon"], 0.5, atol=1e-13)
    assert list(trajectory.status) == ["ground", "ok"]
    blow_up = FunctionPlant(lambda t, x, u: x**2, 1, 1)
    burst = MethodOfSteps().solve(ClosedLoop(blow_up), [[1.0], [-1.0]], 3.0)
    assert list(burst.status) == ["diverged", "ok"]
    assert burst([2.0])[1, 0, 0] == pytest.approx(-1.0 / 3.0, abs=1e-13)


def test_a_tolerance_tells_failures_apart() -> None:
    """The chaotic libration cannot be computed for long by anybody."""
    chaotic = MethodOfSteps(16, tolerance=1e-9).solve(ClosedLoop(Libration()), [0.0, 1.0], 80.0 * np.pi)
    assert list(chaotic.status) == ["failed"]
    loop = ClosedLoop(RotatingEllipsoid())
    fine = solve(loop, [0.0, 1.0, 1.9, 0.0], 20.0, solver="method_of_steps", tolerance=1e-6)
    assert list(fine.status) == ["ok"]


@pytest.mark.parametrize("count", [50, 100, 200, 400])
def test_errors_of_a_plant_that_jumps_are_below_their_estimates(count: int) -> None:
    """x'' = -sign x from 1 at rest: parabolas, each quarter of the period √2 long."""

    def rates(t: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.stack([x[:, 1], -np.sign(x[:, 0]) + 0.0 * u[:, 0]], axis=1)

    trajectory = MethodOfSteps(count).solve(ClosedLoop(FunctionPlant(rates, 2, 1)), [1.0, 0.0], 40.0)
    t, quarter = np.linspace(0.0, 40.0, 1001), np.sqrt(2.0)
    halves, phase = np.divmod(t + quarter, 2.0 * quarter)
    exact = (-1.0) ** halves * (1.0 - 0.5 * (phase - quarter) ** 2)
    error = np.abs(trajectory(t)[:, 0] - exact).max()
    assert error < trajectory.error_estimate[0] < 100.0 * error
    told = MethodOfSteps(count).solve(ClosedLoop(FunctionPlant(rates, 2, 1, smooth=True)), [1.0, 0.0], 40.0)
    assert told.error_estimate[0] < 0.1 * error, "the estimate of a smooth plant is no bound for this one"


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda p: DelayedFeedback([[0.0, 1.0]], 0.0), "`delay` must be positive, but is 0.0"),
        (lambda p: DelayedFeedback([[0.0, 1.0]], 1.0, 0.5), "`switch_on` must not lie before the delay without a hist"),
        (lambda p: DelayedFeedback([[0.0, 1.0]], 1.0, -1.0, history=0.0), "`switch_on` must not lie before time 0"),
        (lambda p: DelayedFeedback([[0.0, 1.0]], 1.0, recall=1.0), r"`recall` must lie in \[0, 1\), but is 1.0"),
        (lambda p: DelayedFeedback([[0.0, 1.0]], [[1.0]]), r"`delay` must have shape \(\) or \(b,\), but is of shape"),
        (lambda p: DelayedFeedback([[0.0, 1.0]], 1.0, history=np.zeros((2, 2))), "`history` must be a function or"),
        (lambda p: DelayedSum(DelayedFeedback([[0.0, 1.0]], 1.0)), "`laws` must be two or more, but is a number of 1"),
        (
            lambda p: DelayedSum(*(DelayedFeedback([[0.0, 1.0]], 1.0, history_breaks=b) for b in ((), -0.5))),
            "`history` must be given with the first, and so its breaks",
        ),
        (lambda p: ClosedLoop(p, DelayedFeedback([0.0, 1.0], 1.0)), r"`gain` must have shape \(1, 2\) or \(b, 1, 2\)"),
        (lambda p: ClosedLoop(p, DelayedFeedback(np.zeros((3, 1, 2)), [1.0, 2.0])), "must have the same batch size"),
        (lambda p: MethodOfSteps(7), "`steps` must be a whole number from 8 to 100000, but is 7"),
        (lambda p: MethodOfSteps(tolerance=1.0), r"`tolerance` must lie in \[0, 1\), but is 1.0"),
        (lambda p: MethodOfSteps().solve(ClosedLoop(p), np.zeros(3), 1.0), r"`initial_state` must have shape \(2,\)"),
        (lambda p: MethodOfSteps().solve(ClosedLoop(p), np.zeros(2), 0.0), "`horizon` must be positive"),
        (lambda p: MethodOfSteps().solve(ClosedLoop(p), np.zeros(2), 1.0)([2.0]), r"`times` must lie in \[0, 1\]"),
    ],
)
def test_bad_input_is_refused_in_sentences(make: object, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make(Libration())


def test_laws_of_the_other_kind_are_refused_with_the_solver_to_use() -> None:
    fractional = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91))
    with pytest.raises(UnsupportedError, match="method_of_steps solver does not take PDAlpha; use 'contour'"):
        MethodOfSteps().solve(fractional, np.zeros(2), 1.0)
    with pytest.raises(UnsupportedError, match="method_of_steps solver does not take PDAlpha; use 'explicit_memory'"):
        MethodOfSteps().solve(ClosedLoop(Libration(), PDAlpha(0.85, 2.0, 0.91)), np.zeros(2), 1.0)
    with pytest.raises(UnsupportedError, match="this one has delayed states; use 'method_of_steps'"):
        solve(ClosedLoop(HCWOutOfPlane(), DelayedFeedback(GAIN, 1.0)), np.zeros(2), 1.0)
    with pytest.raises(ArgumentError, match="did you mean 'method_of_steps'"):
        solve(fractional, np.zeros(2), 1.0, solver="method_of_step")
