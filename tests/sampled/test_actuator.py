"""Thrusters in closed form, and what a limit does to a memory."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import PD, PID, PDAlpha, Saturation
from fracctl.errors import ArgumentError
from fracctl.plants import HCWOutOfPlane, LinearPlant
from fracctl.sampled import Actuator, Navigation, SampledLaw, Window, simulate
from fracctl.sampled.measures import final_rms

DEMAND = np.array([[3.0, -4.0], [0.05, 0.3], [-0.2, 0.0]])


def test_by_axis_and_by_norm() -> None:
    control, limited = Actuator(Saturation(1.0, by="axis"))(DEMAND, 0.1)
    np.testing.assert_array_equal(control, [[1.0, -1.0], [0.05, 0.3], [-0.2, 0.0]])
    assert limited.tolist() == [[True, True], [False, False], [False, False]]
    _, limited = Actuator(Saturation(3.5, by="axis"))(DEMAND, 0.1)
    assert limited[0].tolist() == [False, True]
    control, _ = Actuator(Saturation(1.0))(DEMAND, 0.1)
    np.testing.assert_allclose(control, [[0.6, -0.8], [0.05, 0.3], [-0.2, 0.0]], rtol=1e-15)


def test_deadband_and_impulse_bit() -> None:
    control, limited = Actuator(deadband=[0.1, 0.3])(DEMAND, 0.1)
    np.testing.assert_array_equal(control, [[3.0, -4.0], [0.0, 0.3], [-0.2, 0.0]])
    assert not limited.any()
    control, _ = Actuator(impulse_bit=0.03)(DEMAND, 0.1)
    np.testing.assert_allclose(control, [[3.0, -4.0], [0.0, 0.3], [-0.3, 0.0]], rtol=1e-15)


def test_an_engine_that_is_turned_fires_its_bit_in_the_direction_of_the_demand() -> None:
    demand = np.array([[3.0, -4.0], [0.15, 0.2], [0.06, -0.08], [0.0, 0.0]])
    control, _ = Actuator(Saturation(1.0), impulse_bit=0.03)(demand, 0.1)
    np.testing.assert_allclose(control, [[0.6, -0.8], [0.18, 0.24], [0.0, 0.0], [0.0, 0.0]], rtol=1e-15)


def test_a_bit_beyond_the_limit_is_refused() -> None:
    law = SampledLaw(PD(1.0, 1.0), Window(2), 0.1)
    for limit in (Saturation(0.2, by="axis"), Saturation(0.2)):
        with pytest.raises(ArgumentError, match=r"`impulse_bit` must be at most .* in a period, 0.02, but is 0.03"):
            simulate(LinearPlant(0.0), law, [1.0, 0.0], 1.0, actuator=Actuator(limit, impulse_bit=0.03))
        simulate(LinearPlant(0.0), law, [1.0, 0.0], 1.0, actuator=Actuator(limit, impulse_bit=0.02))


def test_a_limit_holds_the_integrals_that_drive_it_and_no_others() -> None:
    """On two uncoupled axes, the one at its limit flies as if it were alone, and so does the other."""
    both, one = LinearPlant(np.zeros((2, 2))), LinearPlant(0.0)
    law = {m: SampledLaw(PID(np.eye(m), 0.3 * np.eye(m), 2.0 * np.eye(m), 0.1), Window(2), 0.05) for m in (1, 2)}
    thrusters = Actuator(Saturation(0.2, by="axis"))
    far, near = [5.0, 0.0], [0.02, 0.0]
    flown = [simulate(one, law[1], s, 60.0, actuator=thrusters, anti_windup="hold_integrals") for s in (far, near)]
    start = [far[0], near[0], 0.0, 0.0]
    together = simulate(both, law[2], start, 60.0, actuator=thrusters, anti_windup="hold_integrals")
    assert flown[0].saturated_share[0] > 0.1
    assert flown[1].saturated_share[0] == 0.0
    for axis, alone in enumerate(flown):
        np.testing.assert_allclose(together.states[:, axis], alone.states[:, 0], rtol=0.0, atol=1e-12)


def test_an_integral_that_leads_away_from_the_limit_goes_on() -> None:
    """While the damping alone keeps the thrusters at their limit, an error of the other sign is integrated."""
    law, limit = SampledLaw(PID(0.0, 0.01, 2.0, 0.1), Window(2), 0.05, feed="velocity"), Actuator(Saturation(0.2))
    flights = {
        (place, word): simulate(LinearPlant(0.0), law, [place, 1.0], 10.0, actuator=limit, anti_windup=word)
        for place in (-5.0, 5.0)
        for word in ("none", "hold_integrals")
    }
    assert all(flight.saturated_share[0] > 0.4 for flight in flights.values())
    np.testing.assert_array_equal(flights[-5.0, "none"].states, flights[-5.0, "hold_integrals"].states)
    assert np.abs(flights[5.0, "none"].controls - flights[5.0, "hold_integrals"].controls).max() > 1e-3


def test_a_deadband_leaves_a_drift_alone() -> None:
    """A free mass inside the deadband is not touched; a full thrust stops another at v²/(2a)."""
    mass = LinearPlant(0.0)
    slow = simulate(mass, SampledLaw(PD(1.0, 0.0), Window(2), 0.1), [0.01, 1e-3], 10.0, actuator=Actuator(deadband=0.1))
    assert slow.states[-1].tolist() == pytest.approx([0.02, 1e-3])
    limited = Actuator(Saturation(0.5))
    fast = simulate(mass, SampledLaw(PD(0.0, 1e6), Window(2), 1e-3, feed="velocity"), [0.0, 1.0], 1.9, actuator=limited)
    assert fast.states[-1, 0] == pytest.approx(1.9 - 0.25 * 1.9**2, abs=1e-9)
    assert fast.saturated_share[0] == 1.0


def test_integrals_wind_up_and_memories_of_positions_do_not() -> None:
    plant, limit = LinearPlant(0.0), Actuator(Saturation(0.2))
    pid, alpha = PID(1.0, 0.3, 2.0, 0.1), PDAlpha(3.0, 4.0, 0.9)
    flights = {
        (name, word): simulate(
            plant, SampledLaw(law, Window(40), 0.05), [5.0, 0.0], 60.0, actuator=limit, anti_windup=word
        )
        for name, law in (("pid", pid), ("alpha", alpha))
        for word in ("none", "hold_integrals")
    }
    overshoot = {key: -flight.states[:, 0].min() for key, flight in flights.items()}
    assert overshoot["pid", "hold_integrals"] < 0.5 * overshoot["pid", "none"]
    np.testing.assert_array_equal(flights["alpha", "none"].states, flights["alpha", "hold_integrals"].states)


def test_a_restart_begins_the_memory_at_the_present() -> None:
    """At a limit all the time, the demand is k_p ξ with the last slope alone: that of a memory of two samples."""
    plant = HCWOutOfPlane()
    law = SampledLaw(PDAlpha(3.0, 4.0, 0.9), Window(40), 0.05)
    short = SampledLaw(PDAlpha(3.0, 4.0, 0.9), Window(2), 0.05)
    always = Actuator(Saturation(1e-9))
    flights = [
        simulate(plant, law, [1.0, 0.0], 5.0, actuator=always, anti_windup="restart"),
        simulate(plant, short, [1.0, 0.0], 5.0, actuator=always),
    ]
    np.testing.assert_array_equal(flights[0].states, flights[1].states)


def test_noise_has_its_size_and_belongs_to_its_axis() -> None:
    errors = np.stack(list(Navigation([1.0, 0.0], 3.0, velocity_bias=0.5).errors(5, range(50), 2, 400)))
    assert errors.shape == (400, 50, 4)
    np.testing.assert_allclose(errors.std(axis=(0, 1)), [1.0, 0.0, 3.0, 3.0], rtol=0.02)
    np.testing.assert_allclose(errors.mean(axis=(0, 1)), [0.0, 0.0, 0.5, 0.5], atol=0.06)
    np.testing.assert_allclose(np.corrcoef(errors[..., 0].ravel(), errors[..., 2].ravel())[0, 1], 0.0, atol=0.03)


def test_the_final_rms_is_taken_over_the_end() -> None:
    flight = simulate(LinearPlant(0.0), SampledLaw(PD(0.0, 0.0), Window(2), 0.1), [0.0, 1.0], 10.0)
    position, control = final_rms(flight, 0.1)
    assert position[0] == pytest.approx(10.0)
    assert control[0] == 0.0


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Actuator(deadband=-1.0), "deadband"),
        (lambda: Actuator(impulse_bit=-1.0), "impulse_bit"),
        (lambda: Navigation(position_noise=-1.0), "position_noise"),
        (lambda: Navigation(every=0), "every"),
    ],
)
def test_refusals(make: object, name: str) -> None:
    with pytest.raises(ArgumentError, match=f"`{name}`"):
        make()  # type: ignore[operator]
