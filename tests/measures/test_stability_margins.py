"""Measures of loops in the rows of an evaluation: one value a design point, repeated for each initial condition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fracctl.controllers import PDAlpha
from fracctl.errors import ArgumentError
from fracctl.evaluation import Evaluation
from fracctl.loop import ClosedLoop
from fracctl.measures import LoopMeasure, NoiseGain, Sensitivity, SettlingTime, StabilityMargins
from fracctl.measures.base import trajectories_of
from fracctl.plants import Chief, HCWOutOfPlane, LinearPlant
from fracctl.solvers import Contour
from fracctl.stability import margins, noise_gain
from fracctl.store.columns import unit

STARTS = {"ic1": np.array([0.0, 0.002]), "ic2": np.array([-0.001, 0.0])}
NAMED = {"settling_time": ("settling_time",), "quiet": ("settling_time", "noise_gain")}
MEASURES = (StabilityMargins(), Sensitivity(), NoiseGain(0.02))
DESIGN = {"alpha_w": [0.91, 1.0, 0.9, 1.0], "k_p_w": [0.85, 0.55, -0.5, 0.5], "k_d_w": [2.0, 2.0, 2.0, -1.0]}


def evaluation() -> Evaluation:
    needed = (HCWOutOfPlane(), PDAlpha, {}, STARTS, Contour(), (SettlingTime(),), NAMED, "quiet", 40.0)
    return Evaluation(*needed, loop_measures=MEASURES)


def test_the_rows_hold_what_the_loop_measures() -> None:
    rows = evaluation()({name: np.array(values) for name, values in DESIGN.items()})
    assert list(rows["initial_condition"]) == ["ic1"] * 4 + ["ic2"] * 4
    for row in range(8):
        k_p, k_d, alpha = (rows[name][row] for name in ("k_p_w", "k_d_w", "alpha_w"))
        loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, alpha))
        expected = margins(loop)
        for column in (*StabilityMargins.columns, *Sensitivity.columns):
            assert rows[column][row] == pytest.approx(getattr(expected, column), rel=1e-9, nan_ok=True)
        assert rows["noise_gain"][row] == pytest.approx(noise_gain(loop, 0.02), rel=1e-12, nan_ok=True)
    assert list(rows["status"][[0, 1, 3]]) == ["ok", "ok", "unstable"]
    assert np.isinf(rows["gain_margin_db"][0]), "no factor makes it unstable, and the row is sound all the same"
    mean = np.sqrt(rows["settling_time"][:2] * rows["noise_gain"][:2])
    np.testing.assert_allclose(rows["objective_quiet"][:2], mean)


def test_columns_and_units() -> None:
    assert evaluation().measured_columns == (
        "settling_time",
        *StabilityMargins.columns,
        *Sensitivity.columns,
        "noise_gain",
    )
    units = {name: unit(name) for name in ("gain_margin_db", "phase_margin_deg", "delay_margin", "delay_margin_s")}
    assert list(units.values()) == ["dB", "deg", "1", "s"]


def test_what_a_measure_of_loops_is() -> None:
    assert all(isinstance(measure, LoopMeasure) for measure in MEASURES)
    assert not isinstance(SettlingTime(), LoopMeasure)
    assert trajectories_of(StabilityMargins) == "Trajectory"
    with pytest.raises(ArgumentError, match="must not be given beside sample_period"):
        NoiseGain(0.01, 10.0)
    with pytest.raises(ArgumentError, match="`sample_period_s` needs a plant with units"):
        NoiseGain(sample_period_s=10.0).for_flight(LinearPlant(-1.0))
    with pytest.raises(ArgumentError, match="sample_period"):
        NoiseGain(-1.0)
    with pytest.raises(ArgumentError, match="constraints"):
        replace(evaluation(), constraints={"phase": None})  # type: ignore[dict-item]


def test_a_period_in_seconds_is_that_of_the_chief() -> None:
    plant = HCWOutOfPlane(Chief(altitude_km=500.0))
    loop = ClosedLoop(plant, PDAlpha(0.85, 2.0, 0.91))
    assert plant.scales is not None
    expected = noise_gain(loop, 10.0 / plant.scales.time_s)
    assert NoiseGain(sample_period_s=10.0).of_loop(loop)["noise_gain"] == pytest.approx(expected, rel=1e-12)
    assert NoiseGain().of_loop(loop)["noise_gain"] != pytest.approx(expected, rel=0.01)
