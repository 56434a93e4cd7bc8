"""Measures of orbits under delayed feedback against closed forms and numbers computed independently of this project."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from fracctl.controllers import DelayedFeedback, DelayedSum
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.measures import (
    Boundedness,
    DeltaVPerOrbit,
    DriftPerOrbit,
    PeriodicityError,
    SettlingPeriods,
    StepwiseMeasure,
    delta_v_per_orbit,
    drift_per_orbit,
    largest_distance,
    periodicity_error,
    settling_periods,
)
from fracctl.measures.largest_multiplier import LargestMultiplier
from fracctl.plants import HCW, Chief, FunctionPlant, Libration, RelativeMotion, RotatingEllipsoid
from fracctl.solvers import MethodOfSteps
from fracctl.stepwise import StepwiseTrajectory
from tests.measures.test_delta_v import EROS, drift

LEADER = Chief(6700.0, gravitational_parameter_km3_s2=398600.5)
TURN = 2.0 * np.pi


def decaying(delay: object, horizon: float) -> StepwiseTrajectory:
    """x = e^{-t} (cos t, sin t), free: |x(t) - x(t-τ)| = e^{-t} |1 - e^{(1 - i) τ}|."""
    plant = FunctionPlant(lambda t, x, u: x @ [[-1.0, 1.0], [-1.0, -1.0]], 2, 2)
    law = DelayedFeedback(np.zeros((2, 2)), delay)
    return MethodOfSteps(100).solve(ClosedLoop(plant, law), [1.0, 0.0], horizon)


def test_periodicity_error_of_a_spiral() -> None:
    delays = np.array([0.5, 1.0, 2.2])
    exact = np.exp(-(6.0 - delays)) * np.abs(1.0 - np.exp((1.0 - 1.0j) * delays))
    np.testing.assert_allclose(periodicity_error(decaying(delays, 6.0)), exact, rtol=1e-11)
    assert periodicity_error(decaying(1.0, 6.0), period=0.5) == pytest.approx(
        np.exp(-5.5) * abs(1.0 - np.exp(0.5 - 0.5j)), rel=1e-11
    )
    assert periodicity_error(decaying(2.0, 1.5)) == np.inf


def test_multipliers_of_a_sum_are_those_of_all_its_terms() -> None:
    """A gain in two parts, one of them a function of time, controls as the whole does."""
    start, measure = [-0.28, -1.08], LargestMultiplier(guess=[-0.28, -1.08])

    def found(law: DelayedFeedback | DelayedSum) -> float:
        trajectory = MethodOfSteps(40).solve(ClosedLoop(Libration(), law), start, 4.0 * TURN)
        return float(measure(trajectory)["largest_multiplier"][0])

    half = DelayedFeedback([[0.0, 0.15]], TURN)
    timed = DelayedFeedback(lambda times: np.broadcast_to([[0.0, 0.15]], (*times.shape, 1, 2)), TURN)
    whole = found(DelayedFeedback([[0.0, 0.3]], TURN))
    assert found(DelayedSum(half, half)) == pytest.approx(whole, rel=1e-9)
    assert found(DelayedSum(half, timed)) == pytest.approx(whole, rel=1e-9)
    assert found(half) != pytest.approx(whole, rel=0.1)
    with pytest.raises(UnsupportedError, match="one delay with one recall"):
        found(DelayedSum(half, DelayedFeedback([[0.0, 0.15]], 2.0 * TURN)))


def test_settling_of_a_spiral() -> None:
    """The error falls below δ at t = ln(|1 - e^{(1 - i) τ}|/δ)."""
    delays, threshold = np.array([0.5, 1.0, 2.2]), 1e-4
    crossing = np.log(np.abs(1.0 - np.exp((1.0 - 1.0j) * delays)) / threshold)
    trajectory = decaying(delays, 14.0)
    np.testing.assert_array_equal(settling_periods(trajectory, threshold), np.ceil(crossing / delays))
    assert np.all(settling_periods(trajectory, 1e-9) == np.inf)
    assert np.all(settling_periods(trajectory, 1e3) == 1.0)


def test_constant_thrust_costs_the_same_every_orbit() -> None:
    """|u| = 10 k from t = τ = 2 on: 20 k an orbit, of whatever length the run is."""
    trajectory = drift([np.eye(2), 0.5 * np.eye(2)], 7.0)
    np.testing.assert_allclose(delta_v_per_orbit(trajectory, 20, "dimensionless"), [20.0, 10.0], rtol=1e-12)
    np.testing.assert_allclose(delta_v_per_orbit(trajectory, 1, "dimensionless"), [20.0, 10.0], rtol=1e-12)
    np.testing.assert_allclose(drift_per_orbit(trajectory, "dimensionless"), 10.0, rtol=1e-12)
    np.testing.assert_allclose(largest_distance(trajectory), 35.0, rtol=1e-12)
    free = MethodOfSteps(10).solve(ClosedLoop(HCW()), np.zeros(6), 1.0)
    assert delta_v_per_orbit(free) == 0.0


def test_controlled_orbits_about_eros() -> None:
    """ΔV of the first 20 controlled orbits in m/s within 5 % of the listed numbers; the errors have fallen."""
    rho, tau = (np.array([row[i] for row in EROS]) for i in (0, 1))
    gains = np.array([[[a, b, c, d], [-b, a, -d, c]] for _, _, (a, b, c, d), _ in EROS])
    starts = np.stack([0 * rho, 1 + 0 * rho, rho, 0 * rho], axis=1)
    trajectory = MethodOfSteps().solve(ClosedLoop(RotatingEllipsoid(), DelayedFeedback(gains, tau)), starts, 90.0)
    np.testing.assert_allclose(delta_v_per_orbit(trajectory), [row[3] for row in EROS], rtol=0.05)
    assert np.all(Boundedness()(trajectory)["bounded"] == 1.0)
    first = np.linalg.norm(trajectory(2.0 * tau[:, None]) - trajectory(tau[:, None]), axis=2)[:, 0]
    assert np.all(periodicity_error(trajectory) < 0.3 * first)


def relative(x0_km: float, eccentricity: float) -> np.ndarray:
    """The start at perigee with the printed ẏ(0), (13)."""
    e = eccentricity
    x = x0_km / 6700.0
    return np.array([x, 0.0, 0.0, 0.0, -x * (2.0 + e) / ((1.0 + e) ** 0.5 * (1.0 - e) ** 1.5), 0.0])


@pytest.mark.parametrize(
    ("x0", "e", "km"), [(2.0, 0.0, 0.0056), (12.0, 0.0, 0.2015), (20.0, 0.0, 0.558), (20.0, 0.005, 0.572)]
)
def test_free_drift_of_a_formation(x0: float, e: float, km: float) -> None:
    """As computed independently of this project; for a circular leader it is 3π x₀²/r to leading order."""
    loop = ClosedLoop(RelativeMotion(LEADER, e))
    trajectory = MethodOfSteps().solve(loop, relative(x0, e), 10.0 * TURN)
    assert drift_per_orbit(trajectory) == pytest.approx(km, abs=6e-4 * (x0 > 3.0) + 6e-5)
    if e == 0.0:
        assert drift_per_orbit(trajectory) == pytest.approx(3.0 * np.pi * x0**2 / 6700.0, rel=0.02)


def test_controlled_formation_does_not_drift() -> None:
    """LQR of the linear motion, Q = I, R = 1e3 I dimensionless, τ = T: below 1e-8 km and 0.005 m/s an orbit."""
    a, b = HCW().jacobians(np.zeros(1), np.zeros((1, 6)), np.zeros((1, 3)))
    gain = b[0].T @ solve_continuous_are(a[0], b[0], np.eye(6), 1e3 * np.eye(3)) / 1e3
    starts = np.stack([relative(2.0, 0.0), relative(20.0, 0.0)])
    loop = ClosedLoop(RelativeMotion(LEADER), DelayedFeedback(gain, TURN))
    trajectory = MethodOfSteps().solve(loop, starts, 31.0 * TURN)
    assert np.all(drift_per_orbit(trajectory) < [1e-8, 1e-8])
    assert np.all(delta_v_per_orbit(trajectory) < [1e-4, 0.005])
    assert np.all(settling_periods(trajectory, 1e-8) < 25.0)


def test_members_that_ended_are_told_by_numbers() -> None:
    """ρ = 1.75 escapes at 5, ρ = 1.9 stays; a member that escapes within its first period has no error."""
    starts = np.array([[0.0, 1.0, 1.75, 0.0], [0.0, 1.0, 1.9, 0.0]])
    trajectory = MethodOfSteps().solve(ClosedLoop(RotatingEllipsoid()), starts, 83.45)
    found = Boundedness(1.0)(trajectory)
    np.testing.assert_array_equal(found["bounded"], [0.0, 1.0])
    assert found["largest_distance"][0] == pytest.approx(5.0, abs=1e-9)
    assert found["largest_distance"][1] < 5.0
    np.testing.assert_array_equal(settling_periods(trajectory, 1e-6, 3.0), np.inf)
    assert np.isfinite(periodicity_error(trajectory, 3.0)).all()
    assert periodicity_error(trajectory, 80.0)[0] == np.inf
    assert drift_per_orbit(trajectory, period=80.0)[0] == np.inf


@pytest.mark.parametrize("kind", [PeriodicityError, SettlingPeriods, DriftPerOrbit, DeltaVPerOrbit, Boundedness])
def test_every_measure_names_its_columns(kind: type[StepwiseMeasure]) -> None:
    measure = kind()
    assert isinstance(measure, StepwiseMeasure)
    loop = ClosedLoop(RelativeMotion(), DelayedFeedback(np.zeros((3, 3, 6)), TURN))
    columns = measure(MethodOfSteps(10).solve(loop, np.zeros(6), 3.0 * TURN))
    assert tuple(columns) == measure.columns
    assert all(values.shape == (3,) and np.isfinite(values).all() for values in columns.values())


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda t: periodicity_error(t, 0.0), "`period` must be positive, of shape"),
        (lambda t: periodicity_error(t, [1.0, 2.0]), r"`period` must have shape \(\) or \(1,\)"),
        (lambda t: settling_periods(t, 0.0), "`threshold` must be positive"),
        (lambda t: delta_v_per_orbit(t, 0), "`orbits` must be a whole number above 0"),
        (lambda t: DeltaVPerOrbit(unit="km"), "`unit` must be 'm_per_s' or 'dimensionless', but is 'km'"),
        (lambda t: DriftPerOrbit("m"), "`unit` must be 'km' or 'dimensionless', but is 'm'"),
        (lambda t: Boundedness(0.0), r"`part` must lie in \(0, 1\]"),
    ],
)
def test_bad_input_is_refused_in_sentences(make: object, sentence: str) -> None:
    trajectory = MethodOfSteps(10).solve(ClosedLoop(Libration()), [0.0, 1.0], 7.0)
    with pytest.raises(ArgumentError, match=sentence):
        make(trajectory)


def test_what_a_plant_lacks_is_said() -> None:
    plant = FunctionPlant(lambda t, x, u: -x, 1, 1)
    free = MethodOfSteps(10).solve(ClosedLoop(plant), [1.0], 7.0)
    for measure in (delta_v_per_orbit, drift_per_orbit):
        with pytest.raises(UnsupportedError, match="has no units; take unit 'dimensionless'"):
            measure(free)
    with pytest.raises(UnsupportedError, match="give `period`"):
        periodicity_error(free)
