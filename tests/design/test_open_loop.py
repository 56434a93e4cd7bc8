"""The least effort of open-loop control: closed forms, the proof by duality, and a published spacecraft case."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracctl.design.open_loop import least_effort
from fracctl.errors import ArgumentError
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant
from fracctl.plants.hcw import Chief

FREE = LinearPlant([[0.0]])


def test_rest_to_rest_of_a_free_mass_is_bang_off_bang() -> None:
    """From ξ = -1, ξ' = 0 to rest in T with |υ| ≤ a: bursts of length b with a b (T - b) = 1, effort 2 a b."""
    time, peak = 4.0, 0.5
    burst = 0.5 * (time - math.sqrt(time**2 - 4.0 / peak))
    found = least_effort(FREE, [-1.0, 0.0], time, peak, segments=2000)
    assert found is not None
    assert found.effort == pytest.approx(2.0 * peak * burst, rel=1e-5)
    assert found.lower_bound <= 2.0 * peak * burst * (1.0 + 1e-9)
    assert found.lower_bound == pytest.approx(2.0 * peak * burst, rel=1e-4)
    assert np.abs(found.controls).max() <= peak * (1.0 + 1e-9)


def test_no_control_gets_there_in_too_short_a_time() -> None:
    """The shortest time is 2 √(1/a)."""
    assert least_effort(FREE, [-1.0, 0.0], 1.99, 1.0) is None
    assert least_effort(FREE, [-1.0, 0.0], 2.01, 1.0) is not None


@pytest.mark.parametrize(
    ("plant", "state"),
    [(HCWOutOfPlane(), [0.0, 0.002]), (HCWInPlane(), [-0.001, 0.002, 0.0, 0.002])],
)
def test_bounds_close_in_and_the_control_leads_to_rest(plant: LinearPlant, state: list[float]) -> None:
    gaps = []
    for segments in (100, 400):
        found = least_effort(plant, state, 3.0, 0.004, segments)
        assert found is not None
        assert found.lower_bound <= found.effort
        gaps.append(found.effort / found.lower_bound - 1.0)
        assert _end(plant, state, found.times, found.controls) == pytest.approx(np.zeros(len(state)), abs=1e-9)
    assert gaps[1] < 0.25 * gaps[0]
    assert gaps[1] < 2e-3


def _end(plant: LinearPlant, state: list[float], times: np.ndarray, controls: np.ndarray) -> np.ndarray:
    """Fly the control by classical Runge-Kutta steps of one segment each."""
    m = plant.n_controls

    def rate(x: np.ndarray, control: np.ndarray) -> np.ndarray:
        return np.concatenate([x[m:], plant.stiffness @ x[:m] + plant.damping @ x[m:] + control])

    x = np.array(state)
    for step, control in zip(np.diff(times), controls, strict=True):
        a = rate(x, control)
        b = rate(x + 0.5 * step * a, control)
        c = rate(x + 0.5 * step * b, control)
        x = x + step / 6.0 * (a + 2.0 * b + 2.0 * c + rate(x + step * c, control))
    return x


def test_the_least_delta_v_of_an_out_of_plane_start() -> None:
    """IC1 in the time and with the peak, 12.3 mm/s², of the fractional law that spends 16.7 m/s."""
    plant = HCWOutOfPlane(Chief())
    assert plant.scales is not None
    found = least_effort(plant, [0.0, 0.002], 3.01276, 3.0939e-3)
    assert found is not None
    assert found.effort * plant.scales.speed_m_s == pytest.approx(13.03, abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (([0.0], 1.0, 1.0), "initial_state"),
        (([0.0, 1.0], 0.0, 1.0), "time"),
        (([0.0, 1.0], 1.0, -1.0), "peak"),
    ],
)
def test_wrong_arguments_are_named(arguments: tuple[list[float], float, float], sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        least_effort(FREE, *arguments)
