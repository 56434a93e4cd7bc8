"""Relative motion under J2 and drag against two satellites in inertial axes and first-order theory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fracctl.controllers import DelayedFeedback
from fracctl.design import lqr
from fracctl.design.delays import natural_period
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.measures import delta_v_per_orbit, drift_per_orbit
from fracctl.plants import HCW, Chief, PerturbedRelativeMotion, RelativeMotion
from fracctl.plants.perturbed_relative_motion import EARTH_J2
from fracctl.solvers import MethodOfSteps
from fracctl.units import EARTH_RADIUS_KM

GM, A_KM, TURN = 398600.5, 6700.0, 2.0 * np.pi
LEADER = Chief(A_KM, inclination_deg=51.6, gravitational_parameter_km3_s2=GM)
UNIT_S = LEADER.scales.time_s


def at(argument_deg: float) -> Chief:
    """The leader with another argument of latitude at time 0."""
    return replace(LEADER, argument_of_latitude_deg=argument_deg)


@pytest.mark.parametrize("e", [0.0, 0.005, 0.3])
def test_without_perturbations_it_is_relative_motion(e: float) -> None:
    """To 1e-9 km over three orbits of a start 20 km away."""
    start, t = np.array([20.0, -2.0, 5.0, 0.0, -30.0, 4.0]) / A_KM, np.linspace(0.0, 3.0 * TURN, 31)
    plants = RelativeMotion(LEADER, e, 75.0), PerturbedRelativeMotion(at(30.0), e, 75.0, j2=0.0)
    one, other = (MethodOfSteps(400).solve(ClosedLoop(plant), start, 3.0 * TURN)(t) for plant in plants)
    np.testing.assert_allclose(other * A_KM, one * A_KM, rtol=0, atol=1e-9)


@pytest.mark.parametrize("e", [0.0, 0.02])
def test_two_satellites_in_inertial_axes(e: float) -> None:
    """J2 and drag in km and s by another integrator, turned into the leader's momentary frame; 1e-8 km, 1e-8 m/s."""
    density, height, ballistic = 1e-10, 45.0, (0.008, 0.02)
    plant = PerturbedRelativeMotion(at(40.0), e, 0.0, EARTH_J2, EARTH_RADIUS_KM, density, height, *ballistic)

    def acceleration(place: np.ndarray, speed: np.ndarray, b: float) -> np.ndarray:
        r = np.linalg.norm(place)
        x, y, z = place
        factor = -1.5 * EARTH_J2 * GM * EARTH_RADIUS_KM**2 / r**5
        oblate = factor * np.array([x, y, z]) * (np.array([1.0, 1.0, 3.0]) - 5.0 * (z / r) ** 2)
        thick = density * np.exp((A_KM - r) / height)
        return -GM * place / r**3 + oblate - 0.5e3 * thick * b * np.linalg.norm(speed) * speed

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        own = [acceleration(y[k : k + 3], y[k + 3 : k + 6], b) for k, b in zip((0, 6), ballistic, strict=True)]
        return np.concatenate([y[3:6], own[0], y[9:12], own[1]])

    def frame(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        place, speed = y[:3], y[3:6]
        momentum = np.cross(place, speed)
        h, r = np.linalg.norm(momentum), np.linalg.norm(place)
        axes = np.stack([place / r, np.cross(momentum, place) / (h * r), momentum / h])
        normal = axes[2] @ acceleration(place, speed, ballistic[0])
        return axes, np.array([r * normal / h, 0.0, h / r**2])

    i, u = np.radians(51.6), np.radians(40.0)
    radial = np.array([np.cos(u), np.sin(u) * np.cos(i), np.sin(u) * np.sin(i)])
    along = np.array([-np.sin(u), np.cos(u) * np.cos(i), np.cos(u) * np.sin(i)])
    speed = np.sqrt(GM / A_KM * (1.0 + e) / (1.0 - e))
    leader = np.concatenate([A_KM * (1.0 - e) * radial, speed * along])
    gap, gap_rate = np.array([5.0, -20.0, 3.0]), np.array([0.001, -0.01, 0.004])
    axes, omega = frame(leader)
    follower = leader + np.concatenate([axes.T @ gap, axes.T @ (gap_rate + np.cross(omega, gap))])
    times = np.linspace(0.0, 3.0 * TURN, 13)
    both = np.concatenate([leader, follower])
    run = solve_ivp(rates, (0.0, times[-1] * UNIT_S), both, "DOP853", times * UNIT_S, rtol=3e-14, atol=1e-12)
    start = np.concatenate([gap / A_KM, gap_rate / A_KM * UNIT_S])
    found = MethodOfSteps(200).solve(ClosedLoop(plant), start, times[-1])(times)
    for state, y in zip(found, run.y.T, strict=True):
        axes, omega = frame(y)
        place = axes @ (y[6:9] - y[:3])
        rate = axes @ (y[9:12] - y[3:6]) - np.cross(omega, place)
        np.testing.assert_allclose(state[:3] * A_KM, place, rtol=0, atol=1e-8)
        np.testing.assert_allclose(state[3:] * A_KM / UNIT_S, rate, rtol=0, atol=1e-11)


def test_members_fly_about_leaders_of_their_own() -> None:
    """A member of a batch has the rates of a plant that is made for it alone, over three orbits."""
    common = {"density_kg_m3": 1e-11, "scale_height_km": 45.0, "leader_ballistic_m2_kg": 0.008}
    drawn = {
        "eccentricity": [0.0, 0.01, 0.05],
        "true_anomaly_deg": [10.0, 200.0, 80.0],
        "argument_of_latitude_deg": [0.0, 120.0, -30.0],
        "density_factor": [0.5, 1.0, 3.0],
        "follower_ballistic_m2_kg": [0.01, 0.02, 0.03],
    }
    batch = PerturbedRelativeMotion(at(40.0), 0.001, 0.0, **common).dispersed_by(**drawn)
    state = np.array([2.0, -1.0, 0.5, 0.0, -3.0, 1.0]) / A_KM * np.array([[1.0], [2.0], [3.0]])
    control = np.full((3, 3), 1e-3)
    for time in (0.0, 0.7 * TURN, 2.9 * TURN):
        found = batch.rates(np.full(3, time), state, control)
        for i, (e, anomaly, argument, factor, ballistic) in enumerate(zip(*drawn.values(), strict=True)):
            own = {**common, "density_kg_m3": factor * 1e-11, "follower_ballistic_m2_kg": ballistic}
            alone = PerturbedRelativeMotion(at(argument), e, anomaly, **own)
            expected = alone.rates(np.array([time]), state[i : i + 1], control[:1])
            np.testing.assert_allclose(found[i : i + 1], expected, rtol=1e-11, atol=1e-13)


def test_what_is_not_given_stays() -> None:
    plant = PerturbedRelativeMotion(at(40.0), 0.01, 30.0, density_kg_m3=1e-11)
    state, control = np.full((2, 6), 1e-4), np.zeros((2, 3))
    expected = plant.rates(np.full(2, 1.0), state, control)
    for same in ({"density_factor": [1.0, 1.0]}, {"eccentricity": [0.01, 0.01]}, {"true_anomaly_deg": [30.0, 30.0]}):
        found = plant.dispersed_by(**same).rates(np.full(2, 1.0), state, control)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-15)
    for wrong, sentence in (
        ({"density_factor": [-1.0]}, "`density_factor` must not be negative"),
        ({"eccentricity": [1.0]}, "`eccentricity` must lie in"),
        ({"anomaly": [1.0]}, "must be one of follower_ballistic_m2_kg"),
    ):
        with pytest.raises(ArgumentError, match=sentence):
            plant.dispersed_by(**wrong)


def test_nodal_period() -> None:
    """T = 2π √(a³/GM) [1 - 3/2 J2 (R/a)² (4 cos² i - 1)] of the mean a, which the energy averaged over an orbit gives.

    E = -1/(2a) + k/2 (3 sin² i sin² u - 1) at the start is -1/(2ā) + k/2 (3/2 sin² i - 1) on the mean.
    """
    for inclination, argument in ((10.0, 0.0), (51.6, 40.0), (97.0, 120.0)):
        s, u = np.sin(np.radians(inclination)), np.radians(argument)
        leader = Chief(A_KM, inclination, GM, argument_of_latitude_deg=argument)
        for j2 in (1e-5, 1e-4, EARTH_J2):
            k = j2 * (EARTH_RADIUS_KM / A_KM) ** 2
            mean = 1.0 / (1.0 - k * (3.0 * s**2 * np.sin(u) ** 2 - 1.5 * s**2))
            theory = TURN * mean**1.5 * (1.0 - 1.5 * k * (4.0 * (1.0 - s**2) - 1.0))
            found = natural_period(PerturbedRelativeMotion(leader, j2=j2))
            assert abs(found - theory) < 100.0 * k**2
    assert natural_period(PerturbedRelativeMotion(at(70.0), 0.1, j2=0.0)) == pytest.approx(TURN, rel=1e-12)


def test_drag_takes_energy_at_the_rate_of_a_circular_orbit() -> None:
    """da/dt = -ρ (C_D A/m) √(GM a), so Δa = -2π ρ (C_D A/m) a² an orbit."""
    density, ballistic = 3e-12, 0.02
    plant = PerturbedRelativeMotion(LEADER, j2=0.0, density_kg_m3=density, leader_ballistic_m2_kg=ballistic)
    r, climb, h = plant.leader_motion(np.array([0.0, TURN]))[:, :3].T
    axis_km = A_KM / (2.0 / r - climb**2 - (h / r) ** 2)
    assert axis_km[0] == pytest.approx(A_KM, rel=1e-13)
    assert axis_km[1] - axis_km[0] == pytest.approx(-TURN * density * ballistic * 1e3 * A_KM**2, rel=1e-3)


def test_the_pole_keeps_its_direction() -> None:
    """Its angle to the orbit normal and its length stay, but for what J2 does in an orbit."""
    plant = PerturbedRelativeMotion(at(25.0), 0.01)
    pole = plant.leader_motion(np.linspace(0.0, 10.0 * TURN, 60))[:, 3:]
    np.testing.assert_allclose(np.linalg.norm(pole, axis=1), 1.0, atol=1e-11)
    np.testing.assert_allclose(np.degrees(np.arccos(pole[:, 2])), 51.6, atol=0.1)


def test_delayed_feedback_under_perturbations() -> None:
    """Under J2 the nodal period costs half of what 2π costs; different drags cost fuel for ever but do not drift."""
    x0 = 2.0 / A_KM
    start, gain = [x0, 0.0, 0.0, 0.0, -2.0 * x0, 0.0], lqr(HCW(), 1.0, 1e3)
    late = []
    for density, held in ((0.0, 0.5), (1e-11, 0.02)):
        plant = PerturbedRelativeMotion(LEADER, density_kg_m3=density, follower_ballistic_m2_kg=0.02)
        laws = (None, DelayedFeedback(gain, natural_period(plant)), DelayedFeedback(gain, TURN))
        runs = [MethodOfSteps(60).solve(ClosedLoop(plant, law), start, 25.0 * TURN) for law in laws]
        assert drift_per_orbit(runs[1]) < held * drift_per_orbit(runs[0])
        if density == 0.0:
            assert delta_v_per_orbit(runs[1]) < 0.6 * delta_v_per_orbit(runs[2])
        late.append(np.abs(runs[1].control(np.linspace(23.0, 24.0, 50) * TURN)).max())
    assert late[1] > 5.0 * late[0]


def test_far_satellites_have_the_right_jacobians_in_a_batch() -> None:
    rng = np.random.default_rng(3)
    plant = PerturbedRelativeMotion(LEADER, 0.01, density_kg_m3=1e-11)
    t, x, u = rng.uniform(0.0, 9.0, 4), 0.01 * rng.normal(size=(4, 6)), rng.normal(size=(4, 3))
    whole = plant.rates(t, x, u)
    for i in range(4):
        np.testing.assert_array_equal(plant.rates(t[i : i + 1], x[i : i + 1], u[i : i + 1])[0], whole[i])
    state, control = plant.jacobians(t, x, u)
    step = 1e-5 * rng.normal(size=(4, 6))
    slope = (plant.rates(t, x + step, u) - plant.rates(t, x - step, u)) / 2.0
    np.testing.assert_allclose(np.einsum("bij,bj->bi", state, step), slope, atol=1e-12)
    np.testing.assert_allclose(control, np.broadcast_to(np.eye(6)[:, 3:], (4, 6, 3)), atol=1e-10)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"eccentricity": 1.0}, r"`eccentricity` must lie in \[0, 1\)"),
        ({"j2": np.nan}, "`j2` must be a finite number"),
        ({"scale_height_km": 0.0}, "`scale_height_km` must be a positive number"),
        ({"density_kg_m3": -1.0}, "`density_kg_m3` must not be negative"),
    ],
)
def test_bad_input_is_refused_in_sentences(options: dict[str, float], sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        PerturbedRelativeMotion(LEADER, **options)


def test_an_equatorial_leader_has_no_node() -> None:
    with pytest.raises(UnsupportedError, match="an equatorial orbit has no node"):
        natural_period(PerturbedRelativeMotion(Chief(A_KM, 0.0)))
