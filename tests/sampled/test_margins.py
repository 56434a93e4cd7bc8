"""Margins of sampled loops: what brings a pole to the unit circle, and what noise leaves behind."""

from __future__ import annotations

import numpy as np
import pytest

import fracctl as fc
from fracctl.controllers import PD, LinearLaw, PDAlpha, PDLag
from fracctl.errors import UnsupportedError
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from fracctl.plants.relative_motion import RelativeMotion
from fracctl.sampled import (
    Exponentials,
    Navigation,
    SampledLaw,
    Window,
    final_rms,
    noise_rms,
    sampled_margins,
    simulate,
)
from fracctl.sampled.margins import SampledResponse, closed_loop, resolvent

PLANT = HCWOutOfPlane()
MODES = Exponentials(40.0, 1e-3)
LAWS = {"pd": (0.55, 2.0), "pd_alpha": (0.85, 2.0, 0.91), "pd_lag": (1.3, 2.0, 0.22)}
KINDS = {"pd": PD, "pd_alpha": PDAlpha, "pd_lag": PDLag}


def law(name: str, factor: float = 1.0) -> LinearLaw:
    k_p, k_d, *rest = LAWS[name]
    made: LinearLaw = KINDS[name](factor * k_p, factor * k_d, *rest)
    return made


def radius(name: str, delay: float, factor: float = 1.0, period: float = 0.05) -> float:
    loop = closed_loop(PLANT, SampledLaw(law(name, factor), MODES, period, delay).discrete(1))
    return float(np.abs(np.linalg.eigvals(loop)).max())


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 2.6])
@pytest.mark.parametrize("name", LAWS)
def test_the_gain_margin_brings_a_pole_to_the_circle(name: str, delay: float) -> None:
    margin = sampled_margins(PLANT, SampledLaw(law(name), MODES, 0.05, delay).discrete(1)).gain_margin
    assert 1.0 < margin < 200.0
    assert radius(name, delay, margin) == pytest.approx(1.0, abs=1e-8)
    assert radius(name, delay, 0.99 * margin) < 1.0 < radius(name, delay, 1.01 * margin)


@pytest.mark.parametrize("name", LAWS)
def test_the_delay_margin_counts_whole_periods(name: str) -> None:
    """A delay by whole periods is z^-d, so the loop is stable up to the last below the margin and not beyond."""
    found = sampled_margins(PLANT, SampledLaw(law(name), MODES, 0.05).discrete(1))
    periods = int(found.delay_margin / 0.05)
    assert periods >= 5
    assert radius(name, periods) < 1.0 < radius(name, periods + 1)
    assert found.delay_margin_s == pytest.approx(found.delay_margin / 6.3134e-4, rel=1e-4)


@pytest.mark.parametrize("name", LAWS)
def test_fast_sampling_has_the_margins_of_the_continuous_loop(name: str) -> None:
    ideal = fc.stability.margins(fc.ClosedLoop(PLANT, law(name)))
    found = sampled_margins(PLANT, SampledLaw(law(name), Exponentials(300.0, 1e-4), 1e-4, feed="velocity").discrete(1))
    assert found.phase_margin_deg == pytest.approx(ideal.phase_margin_deg, abs=0.02)
    assert found.sensitivity_peak == pytest.approx(ideal.sensitivity_peak, abs=1e-3)
    assert found.disk_margin == pytest.approx(ideal.disk_margin, abs=1e-3)


def test_the_peak_of_sensitivity_is_the_nearest_approach_to_minus_one() -> None:
    controller = SampledLaw(law("pd_lag"), MODES, 0.05, 0.4).discrete(1)
    response = SampledResponse(PLANT, controller)
    control, plant = response(np.linspace(0.5, 20.0, 40000)[None], np.zeros(1, dtype=int))
    nearest = np.abs(1.0 + control / plant).min()
    assert sampled_margins(PLANT, controller).sensitivity_peak == pytest.approx(1.0 / nearest, rel=1e-6)


def test_the_resolvent_is_finite_at_a_pole() -> None:
    turn = np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]])
    adjugate, determinant = resolvent(turn, np.expm1(1j * np.array([0.1, 0.4])))
    assert abs(determinant[0]) < 1e-16
    expected = np.linalg.inv(np.exp(0.4j) * np.eye(2) - turn)
    np.testing.assert_allclose(adjugate[1] / determinant[1], expected, rtol=1e-12)


def test_in_plane_margins() -> None:
    gains = ([[4.1, -1.55], [3.15, 0.9]], [[2.7, 1.05], [0.9, 2.05]], [0.98, 0.9])
    ideal = fc.stability.margins(fc.ClosedLoop(HCWInPlane(), PDAlpha(*gains)))
    controller = SampledLaw(PDAlpha(*gains), Exponentials(100.0, 1e-4), 1e-3, feed="velocity").discrete(2)
    found = sampled_margins(HCWInPlane(), controller)
    assert found.stable
    assert found.disk_margin == pytest.approx(ideal.disk_margin, rel=2e-3)
    assert np.isnan(found.gain_margin)


def test_the_closed_loop_is_what_is_flown() -> None:
    for delay in (0.0, 0.4, 1.0, 2.7):
        controller = SampledLaw(law("pd_alpha"), Window(6), 0.1, delay).discrete(1)
        flight = simulate(PLANT, controller, [0.3, 1.0], 4.0)
        state = np.concatenate([[0.3, 1.0], controller.e @ [0.3, 1.0]])
        matrix = closed_loop(PLANT, controller)
        state = np.concatenate([state, np.zeros(len(matrix) - len(state))])
        expected = np.linalg.matrix_power(matrix, 40) @ state
        np.testing.assert_allclose(flight.states[-1], expected[:2], rtol=1e-10)


@pytest.mark.parametrize("delay", [0.0, 0.4, 1.0, 2.0])
def test_noise_leaves_what_lyapunovs_equation_says(delay: float) -> None:
    controller = SampledLaw(law("pd_alpha"), Exponentials(20.0, 1e-2), 0.05, delay).discrete(1)
    position, control = noise_rms(PLANT, controller, 2.0, 0.0)
    flight = simulate(PLANT, controller, np.zeros((200, 2)), 150.0, navigation=Navigation(2.0), seed=4)
    found = [np.sqrt((values**2).mean()) for values in final_rms(flight, 120.0)]
    assert found[0] == pytest.approx(position[0], rel=0.02)
    assert found[1] == pytest.approx(control[0], rel=0.01)


def test_an_unstable_loop_has_no_margins() -> None:
    controller = SampledLaw(PD(0.55, 2.0), MODES, 2.5).discrete(1)
    with pytest.raises(UnsupportedError, match="not stable"):
        noise_rms(PLANT, controller, 1.0, 0.0)
    found = sampled_margins(PLANT, SampledLaw(PD(0.55, 2.0), MODES, 2.5).discrete(1))
    assert found.stable is False
    assert np.isnan(found.sensitivity_peak)


def test_refusals() -> None:
    with pytest.raises(UnsupportedError, match="linear plant"):
        sampled_margins(RelativeMotion(), SampledLaw(PD(np.eye(3), np.eye(3)), MODES, 0.1).discrete(3))
    with pytest.raises(UnsupportedError, match="states"):
        sampled_margins(PLANT, SampledLaw(law("pd_alpha"), Window(3000), 0.1).discrete(1))
