"""What is uncertain of a flight, against the definitions."""

from __future__ import annotations

import numpy as np
import pytest

import fracctl as fc
from fracctl.dispersions import Distribution
from fracctl.errors import ArgumentError
from fracctl.flight import Surroundings
from fracctl.flight.uncertain import offset_names, starts
from fracctl.plants import HCW, HCWInPlane, HCWOutOfPlane
from fracctl.plants.relative_motion import RelativeMotion
from fracctl.plants.tschauner_hempel import TschaunerHempel
from fracctl.sampled import Actuator, Navigation
from fracctl.units import Spacecraft

PLANT = HCW()
SCALES = PLANT.scales
NOMINAL = np.array([3e-4, -4e-4, 0.0, 0.0, 0.0, 2e-3])


def test_offsets_in_metres_and_in_per_cent() -> None:
    drawn = {
        "offset_u_m": np.array([10.0, -20.0]),
        "offset_w_dot_m_s": np.array([0.5, 0.0]),
        "offset_v_percent": np.array([0.0, 2.0]),
        "offset_u_dot_percent": np.array([1.0, 0.0]),
    }
    moved = starts(PLANT, NOMINAL, drawn) - NOMINAL
    assert moved[:, 0] * SCALES.length_m == pytest.approx([10.0, -20.0])
    assert moved[:, 5] * SCALES.speed_m_s == pytest.approx([0.5, 0.0])
    assert moved[:, 1] == pytest.approx([0.0, 0.02 * 5e-4]), "of the distance, which is 5e-4"
    assert moved[:, 3] == pytest.approx([0.01 * 2e-3, 0.0]), "of the speed"
    assert not moved[:, [2, 4]].any()


def test_names_follow_the_plant() -> None:
    assert offset_names(HCWOutOfPlane()) == [
        *("offset_w_m", "offset_w_dot_m_s", "offset_w_percent", "offset_w_dot_percent"),
    ]
    assert "offset_v_dot_percent" in offset_names(HCWInPlane())


def met(dispersions: dict[str, list[float | str]], count: int = 3, **further: object) -> object:
    given = {name: Distribution.of(numbers) for name, numbers in dispersions.items()}
    around = Surroundings(PLANT, RelativeMotion(PLANT.chief), dispersions=given, **further)  # type: ignore[arg-type]
    samples = np.arange(float(count))
    return around.of("dispersed", NOMINAL, around.drawn(samples), count)


def test_a_lighter_spacecraft_is_pushed_harder() -> None:
    found = met({"mass_kg": ["choice", 400.0], "thrust_factor": ["choice", 0.9]}, spacecraft=Spacecraft(mass_kg=500.0))
    control, limited = found.actuator(np.full((3, 3), 1e-3), 0.01)
    np.testing.assert_allclose(control, 1e-3 * 0.9 * 500.0 / 400.0)
    assert not limited.any()


def test_a_limit_is_one_of_force() -> None:
    """Saturated at L m₀, a spacecraft of half the mass feels twice the acceleration."""
    thrusters = Actuator(fc.controllers.Saturation(1e-3, "axis"))
    found = met({"mass_kg": ["choice", 250.0]}, spacecraft=Spacecraft(mass_kg=500.0), actuator=thrusters)
    control, limited = found.actuator(np.full((3, 3), 5e-3), 0.01)
    np.testing.assert_allclose(control, 2e-3)
    assert limited.all()


def test_noise_and_bias_of_every_flight() -> None:
    navigation = Navigation(1.0 / SCALES.length_m, 0.0, position_bias=2.0 / SCALES.length_m)
    found = met(
        {"position_noise_m": ["uniform", 1.0, 5.0], "position_bias_v_m": ["choice", 7.0]}, navigation=navigation
    )
    noise = found.navigation.position_noise[:, 0] * SCALES.length_m
    assert len(set(noise.tolist())) == 3
    assert ((noise >= 1.0) & (noise <= 5.0)).all()
    np.testing.assert_allclose(found.navigation.position_bias * SCALES.length_m, [[2.0, 9.0, 2.0]] * 3)
    assert not np.any(found.navigation.velocity_noise)


def test_every_flight_has_its_noise() -> None:
    errors = Navigation(np.array([[1.0], [3.0]]), 0.0).errors(0, [4, 5], 2, 4000)
    drawn = np.stack(list(errors))
    np.testing.assert_allclose(drawn[:, :, :2].std(axis=0), [[1.0, 1.0], [3.0, 3.0]], rtol=0.05)
    (alone,) = Navigation(3.0, 0.0).errors(0, [5], 2, 1)
    np.testing.assert_array_equal(alone[0], drawn[0, 1], err_msg="the second flight's, by itself")


@pytest.mark.parametrize("kind", [RelativeMotion, TschaunerHempel])
def test_leaders_of_their_own(kind: type) -> None:
    eccentricities, anomalies = np.array([0.0, 0.1, 0.7]), np.array([0.0, 200.0, -30.0])
    together = kind(PLANT.chief).dispersed_by(eccentricities, anomalies)
    t, x, u = np.array([0.3, 2.0, 40.0]), np.tile(NOMINAL, (3, 1)), np.zeros((3, 3))
    rates, jacobians = together.rates(t, x, u), together.jacobians(t, x, u)[0]
    for i in range(3):
        alone, one = kind(PLANT.chief, eccentricities[i], anomalies[i]), slice(i, i + 1)
        np.testing.assert_array_equal(rates[one], alone.rates(t[one], x[one], u[one]))
        np.testing.assert_array_equal(jacobians[one], alone.jacobians(t[one], x[one], u[one])[0])


def test_what_is_not_dispersed_stays() -> None:
    plant = RelativeMotion(PLANT.chief, 0.2, 90.0)
    t, x, u = np.zeros(2), np.tile(NOMINAL, (2, 1)), np.zeros((2, 3))
    other = plant.dispersed_by(true_anomaly_deg=np.array([90.0, 91.0]))
    np.testing.assert_array_equal(other.rates(t, x, u)[0], plant.rates(t, x, u)[0])
    assert (other.rates(t, x, u)[1] != plant.rates(t, x, u)[1]).any()


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: RelativeMotion().dispersed_by(eccentricity=[0.1, 1.0]), "eccentricity"),
        (lambda: met({"offset_x_m": ["normal", 0, 1]}), "dispersions"),
        (lambda: met({"mass_kg": ["normal", 500, 1]}), "dispersions"),
        (lambda: Surroundings(HCWOutOfPlane(), RelativeMotion()), "truth"),
        (lambda: Actuator(efficiency=0.0), "efficiency"),
        (lambda: Navigation(position_noise=np.array([[1.0], [-1.0]])), "position_noise"),
    ],
)
def test_refusals(make: object, name: str) -> None:
    with pytest.raises(ArgumentError, match=f"`{name}`"):
        make()  # type: ignore[operator]
