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
    assert limited.tolist() == [True, False, False]
    control, _ = Actuator(Saturation(1.0))(DEMAND, 0.1)
    np.testing.assert_allclose(control, [[0.6, -0.8], [0.05, 0.3], [-0.2, 0.0]], rtol=1e-15)


def test_deadband_and_impulse_bit() -> None:
    control, limited = Actuator(deadband=[0.1, 0.3])(DEMAND, 0.1)
    np.testing.assert_array_equal(control, [[3.0, -4.0], [0.0, 0.3], [-0.2, 0.0]])
    assert not limited.any()
    control, _ = Actuator(impulse_bit=0.03)(DEMAND, 0.1)
    np.testing.assert_allclose(control, [[3.0, -4.0], [0.0, 0.3], [-0.3, 0.0]], rtol=1e-15)


def test_a_limit_below_the_bit_still_fires_bits() -> None:
    control, _ = Actuator(Saturation(0.2, by="axis"), impulse_bit=0.03)(DEMAND, 0.1)
    np.testing.assert_allclose(control[0], [0.3, -0.3], rtol=1e-15)


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
