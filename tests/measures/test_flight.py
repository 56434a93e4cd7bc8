"""Measures in SI units: spec tables, closed forms, and what must not change the rows."""

from __future__ import annotations

import math

import numpy as np
import pytest

import fracctl as fc
from fracctl.config.build import build_evaluation
from fracctl.config.compose import compose
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.measures.fuel import DeltaV, PeakForce, PeakThrust, Propellant, StationKeeping, magnitude_integral
from fracctl.measures.hold_error import HoldError
from fracctl.measures.in_units import InUnits
from fracctl.measures.open_loop_bound import OpenLoopBound
from fracctl.measures.overshoot_m import OvershootM
from fracctl.measures.settling_times import SettlingTimes
from fracctl.plants import HCW, HCWOutOfPlane, LinearPlant, RelativeMotion
from fracctl.trajectory import Trajectory
from fracctl.units import Spacecraft

PLANT = HCWOutOfPlane()
LAWS = {"pd": (0.55, 2.0, 1.0), "pd_alpha": (0.85, 2.0, 0.91)}


def flown(law: str, periods: float = 12.0) -> Trajectory:
    k_p, k_d, alpha = LAWS[law]
    loop = fc.ClosedLoop(PLANT, fc.controllers.PDAlpha(k_p, k_d, alpha))
    return fc.solve(loop, [0.0, 0.002], 2.0 * math.pi * periods, tolerance=1e-10)


def test_settling_times_of_ic1_to_all_bands() -> None:
    """In orbits, to the printed digits: what the algebraic tail of the fractional law costs below 100 m."""
    bands = (1000.0, 300.0, 100.0, 30.0, 10.0, 1.0)
    printed = {"pd": [0.484, 0.580, 0.632, 1.08, 1.19, 1.62], "pd_alpha": [0.382, 0.446, 0.479, 1.32, 2.15, 6.36]}
    measure = SettlingTimes(bands).for_flight(PLANT)
    for law, expected in printed.items():
        found = measure(flown(law))
        assert tuple(found) == measure.columns
        for band, orbits in zip(bands, expected, strict=True):
            column, digits = f"settling_time_{band:g}_m", 3 if orbits < 1.0 else 2
            assert round(float(found[f"{column}_orbits"][0]), digits) == orbits, (law, band)
            minutes = found[f"{column}_orbits"] * PLANT.scales.period_s / 60.0
            np.testing.assert_allclose(found[f"{column}_min"], minutes, rtol=1e-14)
            np.testing.assert_allclose(found[column], 2.0 * np.pi * found[f"{column}_orbits"], rtol=1e-14)


def test_what_ic1_spends_above_the_open_loop_bound() -> None:
    """PD^0.91 spends 16.7 m/s; in its 0.48 orbit and at its own peak 13.0 m/s are enough, so it is 28 % above."""
    trajectory = flown("pd_alpha", 6.0)
    spent = DeltaV().for_flight(PLANT)(trajectory)
    bound = OpenLoopBound().for_flight(PLANT)(trajectory)
    assert spent["delta_v_m_s"][0] == pytest.approx(16.7, abs=0.05)
    assert spent["delta_v_3d_m_s"][0] == spent["delta_v_m_s"][0]
    assert bound["open_loop_delta_v_m_s"][0] == pytest.approx(13.0, abs=0.05)
    assert bound["above_open_loop_percent"][0] == pytest.approx(28.4, abs=0.2)
    assert PeakThrust().for_flight(PLANT)(trajectory)["peak_acceleration_mm_s2"][0] == pytest.approx(12.33, abs=0.01)


def test_an_unsettled_law_has_no_bound() -> None:
    assert np.isinf(OpenLoopBound(1.0).for_flight(PLANT)(flown("pd_alpha", 2.0))["above_open_loop_percent"]).all()


def test_all_components_together() -> None:
    """w'' = -w - 3w - 4w' from w' = 0.002 on one axis is 0.002 s e^(-2s); on two equal ones |υ| is √2 of one's."""
    double = LinearPlant(-np.eye(2), scales=PLANT.scales)
    law = fc.controllers.PDAlpha(k_p=3.0 * np.eye(2), k_d=4.0 * np.eye(2))
    both = fc.solve(fc.ClosedLoop(double, law), [0, 0, 0.002, 0.002], 20.0)
    alone = fc.solve(fc.ClosedLoop(double, law), [0, 0, 0.002, 0.0], 20.0)
    one = DeltaV().for_flight(double)(alone)
    two = DeltaV().for_flight(double)(both)
    np.testing.assert_allclose(two["delta_v_m_s"], 2.0 * one["delta_v_m_s"], rtol=1e-7)
    np.testing.assert_allclose(two["delta_v_3d_m_s"], math.sqrt(2.0) * one["delta_v_m_s"], rtol=1e-5)


def test_the_magnitude_of_three_components() -> None:
    """∫ |υ| of a fractional loop against the trapezoidal rule on 400 000 samples graded at the start."""
    law = fc.controllers.PDAlpha(
        k_p=[[4.1, -1.55, 0.0], [3.15, 0.9, 0.0], [0.0, 0.0, 0.85]],
        k_d=[[2.7, 1.05, 0.0], [0.9, 2.05, 0.0], [0.0, 0.0, 2.0]],
        alpha=[0.98, 0.90, 0.91],
    )
    trajectory = fc.solve(fc.ClosedLoop(HCW(), law), [-1e-3, 0, 0, 0, 2e-3, 2e-3], 12.0, tolerance=1e-9)
    times = 12.0 * np.linspace(0.0, 1.0, 400_001) ** 8
    expected = np.trapezoid(np.linalg.norm(trajectory.control(times), axis=1), times)
    assert magnitude_integral(trajectory)[0] == pytest.approx(expected, rel=1e-6)


def test_propellant_is_that_of_the_rocket_equation() -> None:
    craft = Spacecraft(mass_kg=500.0, isp_s=220.0)
    trajectory = flown("pd", 6.0)
    spent = float(DeltaV().for_flight(PLANT)(trajectory)["delta_v_m_s"][0])
    found = float(Propellant().for_flight(PLANT, craft)(trajectory)["propellant_kg"][0])
    assert 500.0 * math.log(500.0 / (500.0 - found)) == pytest.approx(500.0 * spent / (9.80665 * 220.0), rel=1e-12)
    with pytest.raises(ArgumentError, match=r"spacecraft.mass_kg"):
        Propellant().for_flight(PLANT)


def test_station_keeping_is_the_last_orbit() -> None:
    """An undamped loop, w = 0.001 sin 2s, controls by 3w for ever: ∫ over 2π is 12e-3; and the orbits add up to ΔV."""
    loop = fc.ClosedLoop(PLANT, fc.controllers.PDAlpha(3.0, 0.0))
    trajectory = fc.solve(loop, [0.0, 0.002], 20.0)
    found = StationKeeping().for_flight(PLANT)(trajectory)["station_keeping_mm_s_per_orbit"]
    assert found[0] == pytest.approx(1e3 * 12e-3 * PLANT.scales.speed_m_s, rel=1e-4)
    whole, shorter = (DeltaV().for_flight(PLANT)(flown("pd_alpha", n))["delta_v_m_s"] for n in (4.0, 3.0))
    last = StationKeeping().for_flight(PLANT)(flown("pd_alpha", 4.0))["station_keeping_mm_s_per_orbit"]
    np.testing.assert_allclose(last, 1e3 * (whole - shorter), rtol=1e-4)


def test_overshoot_in_metres_is_the_paper_s_without_its_scale() -> None:
    """PD at (2, 2): the overshoot 6.8761 = 1 + 1e4 x̂ is 5876 m."""
    loop = fc.ClosedLoop(PLANT, fc.controllers.PDAlpha(2.0, 2.0))
    trajectory = fc.solve(loop, [0.0, 0.002], 12.0 * math.pi)
    assert OvershootM().for_flight(PLANT)(trajectory)["overshoot_m"][0] == pytest.approx(5876.1, abs=0.2)


@pytest.mark.parametrize("measure", [SettlingTimes(), DeltaV(), PeakThrust(), OvershootM(), OpenLoopBound()])
def test_units_are_asked_for(measure: InUnits) -> None:
    with pytest.raises(ArgumentError, match=r"`plant` needs units \(scales\) for this measure"):
        measure.for_flight(LinearPlant(-1.0))
    with pytest.raises(ArgumentError, match="call for_flight"):
        measure(flown("pd", 1.0))  # type: ignore[operator]


def test_what_is_refused() -> None:
    with pytest.raises(ArgumentError, match="`thresholds_m` must hold different positive numbers"):
        SettlingTimes((1.0, 1.0))
    with pytest.raises(ArgumentError, match="must be linear with constant coefficients"):
        OpenLoopBound().for_flight(RelativeMotion())
    with pytest.raises(ConfigurationError, match=r"measures.propellant: spacecraft.mass_kg must be given"):
        build_evaluation(compose(["measures=flight", "+measures.propellant={}"]))


def test_a_band_that_is_not_reached_is_told_of_but_decides_nothing() -> None:
    """Within 4 orbits PD^0.91 does not come to 1 m for good; its row is ok unless that is what is minimised."""
    words = ["experiment=ic1_bands", "horizon_periods=4", "survey=single"]
    design = {"alpha_w": np.array([0.91]), "k_p_w": np.array([0.85]), "k_d_w": np.array([2.0])}
    rows = build_evaluation(compose(words))(design)
    assert np.isinf(rows["settling_time_1_m"]).all()
    assert rows["status"].tolist() == ["ok"]
    aimed = build_evaluation(compose([*words, "objectives.settling_time=[settling_time_1_m]"]))(design)
    assert aimed["status"].tolist() == ["unsettled"]


def test_the_peak_force_is_that_of_the_peak_acceleration() -> None:
    trajectory = flown("pd_alpha", 6.0)
    peak = PeakThrust().for_flight(PLANT)(trajectory)["peak_acceleration_mm_s2"]
    found = PeakForce().for_flight(PLANT, Spacecraft(mass_kg=500.0))(trajectory)
    np.testing.assert_allclose(found["peak_force_n"], 0.5 * peak, rtol=1e-14)
    with pytest.raises(ArgumentError, match=r"spacecraft\.mass_kg"):
        PeakForce().for_flight(PLANT)


def test_hold_error_of_free_motion_is_that_of_a_sine() -> None:
    """w = A sin s has A/√2 over an orbit; a decaying loop holds what is left in its last orbit."""
    measure = HoldError().for_flight(PLANT)
    free = fc.solve(fc.ClosedLoop(PLANT), [0.0, 0.002], 6.0 * math.pi)
    assert measure(free)["hold_error_m"] == pytest.approx([0.002 * PLANT.scales.length_m / math.sqrt(2.0)], rel=1e-8)
    trajectory = flown("pd_alpha", 3.0)
    late = trajectory(np.linspace(4.0 * math.pi, 6.0 * math.pi, 20_001))[..., 0]
    expected = math.sqrt(float((late**2).mean())) * PLANT.scales.length_m
    assert measure(trajectory)["hold_error_m"] == pytest.approx([expected], rel=1e-4)
