"""Flights under sampled laws: the memory's length, convergence, delays, and members that do not know each other."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fracctl as fc
from fracctl.arrays import Floats
from fracctl.controllers import PD, LinearLaw, PDAlpha, PDLag, PILambdaDMu
from fracctl.errors import ArgumentError
from fracctl.plants import HCW, Chief, HCWOutOfPlane
from fracctl.plants.relative_motion import RelativeMotion
from fracctl.sampled import (
    Actuator,
    Exponentials,
    Navigation,
    SampledLaw,
    Window,
    delta_v,
    dimensionless_time,
    peak_control,
    settling_times,
    simulate,
)
from fracctl.sampled.propagation import held

PLANT = HCWOutOfPlane()
ORBIT = 2.0 * np.pi
IC1 = [0.0, 0.002]
PUBLISHED = PDAlpha(0.85, 2.0, 0.91)
LAWS = [PD(0.55, 2.0), PUBLISHED, PDLag(1.3, 2.0, 0.22), PILambdaDMu(1.0, 0.2, 2.0, 0.7, 0.9)]
GAINS = (
    [[4.1, -1.55, 0.0], [3.15, 0.9, 0.0], [0.0, 0.0, 0.85]],
    [[2.7, 1.05, 0.0], [0.9, 2.05, 0.0], [0.0, 0.0, 2.0]],
    [0.98, 0.9, 0.91],
)


def test_the_length_of_the_memory_decides_how_the_tail_ends() -> None:
    """Computed independently: 0.547 orbit to 100 m and 1.07 to 1 m with 10 s and a memory of 0.16 orbit.

    The derivative is Caputo's from a begin that moves along; the whole memory takes 0.479 and 6.36.
    """
    period = dimensionless_time(PLANT, 10.0)
    samples = round(0.16 * ORBIT / period)
    flight = simulate(PLANT, SampledLaw(PUBLISHED, Window(samples), period), IC1, 12.0 * np.pi)
    last = settling_times(flight, [1e-5, 1e-7], at_samples=True) / ORBIT
    assert np.round(last, 3)[0] == 0.547
    assert np.round(last, 2)[1] == 1.07
    fine = dimensionless_time(PLANT, 2.0)
    samples = round(0.16 * ORBIT / fine)
    flight = simulate(PLANT, SampledLaw(PUBLISHED, Window(samples), fine), IC1, 4.0 * np.pi)
    settled = settling_times(flight, [1e-5, 1e-7]) / ORBIT
    assert np.round(settled, 3)[0] == 0.547
    assert np.round(settled, 2)[1] == 1.07


def test_emptying_the_memory_now_and_then_is_another_law() -> None:
    """Caputo's derivative from the last restart jumps there; computed independently, 0.798 and 1.409 orbit."""
    period = dimensionless_time(PLANT, 10.0)
    controller = SampledLaw(PUBLISHED, Window(160), period).discrete(1)
    transition, input_matrix = held(PLANT, period)
    x, positions = np.array([IC1]), []
    for k in range(2000):
        if k % 159 == 0:
            memory = controller.start(x)
        memory, control = controller.step(memory, x)
        positions.append(abs(x[0, 0]))
        x = x @ transition.T + control @ input_matrix.T
    last = [np.flatnonzero(np.array(positions) > delta)[-1] * period / ORBIT for delta in (1e-5, 1e-7)]
    np.testing.assert_allclose(last, [0.7976, 1.4093], atol=1.1e-3)


def test_the_whole_memory_settles_as_the_law_does() -> None:
    period = dimensionless_time(PLANT, 2.0)
    law = SampledLaw(PUBLISHED, Exponentials(14.0 * np.pi, 1e-5), period, feed="velocity")
    flight = simulate(PLANT, law, IC1, 14.0 * np.pi)
    expected = [0.382, 0.446, 0.479, 1.32, 2.15, 6.36]
    settled = settling_times(flight, [1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7]) / ORBIT
    assert (np.abs(settled - expected) < [1e-3, 1e-3, 1e-3, 5e-3, 5e-3, 3e-2]).all()


@pytest.mark.parametrize("delay", [0.0, 0.5])
@pytest.mark.parametrize("feed", ["position", "velocity"])
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_short_periods_converge_to_the_law_at_first_order(law: LinearLaw, feed: str, delay: float) -> None:
    """The hold is late by half a period, whatever the memory does."""
    times = np.array([1.0, 3.0])
    ideal = fc.solve(fc.ClosedLoop(PLANT, law), initial_state=[1.0, 0.5], horizon=3.0, tolerance=1e-10)(times)[:, 0]
    errors = []
    for period in (0.02, 0.01, 0.005):
        sampled = SampledLaw(law, Exponentials(4.0, 1e-8), period, delay, feed)  # type: ignore[arg-type]
        errors.append(np.abs(simulate(PLANT, sampled, [1.0, 0.5], 3.0)(times)[:, 0] - ideal).max())
    order = np.log2(np.divide(errors[:-1], errors[1:]))
    assert order[-1] == pytest.approx(1.0, abs=0.15)
    assert errors[-1] < 0.02


def test_free_motion_is_exact() -> None:
    flight = simulate(PLANT, SampledLaw(PD(0.0, 0.0), Window(2), 0.3), [1.0, 0.0], 30.0)
    np.testing.assert_allclose(flight.states[:, 0], np.cos(flight.times), atol=1e-12)
    between = flight(np.array([0.15, 0.1]))
    np.testing.assert_allclose(between[:, 0], np.cos([0.15, 0.1]), atol=3e-5)
    np.testing.assert_allclose(between[:, 1], -np.sin([0.15, 0.1]), atol=3e-4)
    with pytest.raises(ArgumentError, match="`times`"):
        flight([31.0])


def test_a_held_control_and_its_delay_in_closed_form() -> None:
    """The first measurement asks for -1; it acts from 0.1 on, the second from 0.3."""
    flight = simulate(PLANT, SampledLaw(PD(1.0, 0.0), Window(2), 0.2, 0.5), [1.0, 0.0], 0.4)
    first = np.cos(0.2) - (1.0 - np.cos(0.1))
    assert flight.states[1, 0] == pytest.approx(first, abs=1e-14)
    np.testing.assert_allclose(flight.controls[:, 0], [-1.0, -first], atol=1e-14)
    np.testing.assert_allclose(flight.control([0.05, 0.15, 0.25, 0.35])[:, 0], [0.0, -1.0, -1.0, -first], atol=1e-14)
    assert delta_v(flight) == pytest.approx(0.2 + 0.1 * first, abs=1e-14)
    assert peak_control(flight) == 1.0


def noisy(members: list[int], states: Floats) -> Floats:
    law = SampledLaw(PDAlpha(*GAINS), Exponentials(10.0, 1e-3), 0.02, 0.3)
    flight = simulate(
        RelativeMotion(),
        law,
        states,
        1.0,
        navigation=Navigation(1e-6, 1e-6, position_bias=1e-7, every=3),
        actuator=Actuator(fc.controllers.Saturation(2e-3), impulse_bit=1e-5),
        numbers=members,
        seed=11,
    )
    return flight.states


def test_a_member_is_the_same_in_every_batch() -> None:
    starts = np.random.default_rng(0).uniform(-1e-3, 1e-3, (5, 6))
    together = noisy([0, 1, 2, 3, 7], starts)
    np.testing.assert_array_equal(together, noisy([0, 1, 2, 3, 7], starts))
    np.testing.assert_array_equal(together[[4, 1]], noisy([7, 1], starts[[4, 1]]))
    assert not np.array_equal(together[4], noisy([8], starts[[4]])[0])


def test_short_distances_make_nonlinear_motion_linear() -> None:
    law = SampledLaw(PDAlpha(*GAINS), Window(40), 0.05, 0.4)
    start = np.array([-1.0, 0.3, 0.2, 0.1, 2.0, 2.0])
    departures = []
    for scale in (1e-4, 1e-5):
        flights = [simulate(plant, law, scale * start, 6.0).states for plant in (RelativeMotion(), HCW())]
        departures.append(np.abs(flights[0] - flights[1]).max())
    assert departures[0] / departures[1] == pytest.approx(100.0, rel=0.05)


def test_a_plant_that_depends_on_time_is_asked_at_the_right_times() -> None:
    """Held controls on an elliptic orbit, against SciPy's LSODA from one change of the control to the next."""
    plant = RelativeMotion(eccentricity=0.3)
    flight = simulate(plant, SampledLaw(PD(np.eye(3), np.eye(3)), Window(2), 0.3, 0.4), [1e-3] * 6, 1.5)
    x = np.full(6, 1e-3)
    for k in range(5):
        for begin, end, u in ((0.0, 0.4, flight.controls[k - 1] if k else np.zeros(3)), (0.4, 1.0, flight.controls[k])):
            span = (0.3 * (k + begin), 0.3 * (k + end))
            x = solve_ivp(_rates, span, x, "LSODA", args=(plant, u), rtol=1e-11, atol=1e-16).y[:, -1]
        np.testing.assert_allclose(x, flight.states[k + 1], rtol=1e-8)


def _rates(t: float, x: Floats, plant: RelativeMotion, u: Floats) -> Floats:
    return plant.rates(np.array([t]), x[None], u[None])[0]


def test_measurements_are_held_and_biased() -> None:
    """Every second period only, and a bias moves where the loop comes to rest: (1 + k_p) ξ = -k_p β."""
    law = SampledLaw(PD(1.0, 2.0), Window(2), 0.1, feed="velocity")
    flight = simulate(PLANT, law, IC1, 60.0, navigation=Navigation(position_bias=0.01, every=2))
    np.testing.assert_array_equal(flight.controls[::2], flight.controls[1::2])
    assert flight.states[-1, 0] == pytest.approx(-0.005, rel=1e-6)


def test_a_recorded_start_knows_its_past() -> None:
    """A flight that is continued with its own samples goes on as if nothing had been."""
    law = SampledLaw(PUBLISHED, Window(30), 0.1)
    whole = simulate(PLANT, law, [1.0, 0.0], 8.0)
    late = simulate(PLANT, law, whole.states[50], 3.0, earlier=whole.states[:50])
    np.testing.assert_allclose(late.states, whole.states[50:], atol=1e-14)
    anew = simulate(PLANT, law, whole.states[50], 3.0)
    assert np.abs(anew.states - late.states).max() > 1e-3


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"initial_state": [1.0]}, "initial_state"),
        ({"horizon": 0.0}, "horizon"),
        ({"anti_windup": "clamp"}, "anti_windup"),
        ({"numbers": [1, 2]}, "numbers"),
        ({"earlier": [[1.0]]}, "earlier"),
    ],
)
def test_refusals(options: dict[str, object], name: str) -> None:
    given = {"initial_state": IC1, "horizon": 1.0} | options
    with pytest.raises(ArgumentError, match=f"`{name}`"):
        simulate(PLANT, SampledLaw(PUBLISHED, Window(5), 0.1), **given)  # type: ignore[arg-type]


@pytest.mark.slow
def test_five_hundred_noisy_limited_nonlinear_flights_take_less_than_a_minute() -> None:
    """Six orbits at 10 s; measured 15 s of one core."""
    plant = RelativeMotion(Chief())
    period = dimensionless_time(plant, 10.0)
    starts = [-1e-3, 0.0, 0.0, 0.0, 2e-3, 2e-3] * np.random.default_rng(1).uniform(0.8, 1.2, (500, 6))
    begin = time.process_time()
    flights = simulate(
        plant,
        SampledLaw(PDAlpha(*GAINS), Window(159), period, delay=0.2),
        starts,
        12.0 * np.pi,
        actuator=Actuator(fc.controllers.Saturation(4e-3), impulse_bit=1e-7),
        navigation=Navigation(5e-7, 3e-6),
    )
    settled = settling_times(flights, [1e-4])
    assert time.process_time() - begin < 60.0
    assert np.isfinite(settled).all()


def test_small_distances_fly_as_the_linear_loop_at_second_order() -> None:
    """The first terms of the attraction that are left out are quadratic: half the distance, a quarter of the gap."""
    plant = HCW()
    law = SampledLaw(PDAlpha(*GAINS), Window(60), dimensionless_time(plant, 60.0), delay=0.3)
    start, gaps = np.array([-0.001, 0.0, 0.0, 0.0, 0.002, 0.002]), []
    for factor in (1.0, 0.5, 0.25):
        flights = [simulate(kind, law, factor * start, ORBIT) for kind in (plant, RelativeMotion(plant.chief))]
        gaps.append(np.abs(flights[0].at_samples - flights[1].at_samples).max())
    orders = np.log2(np.array(gaps[:-1]) / gaps[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.02)
    assert gaps[0] < 1e-6
