"""Figures of a flight: directions, units, bands, bounds, and ΔV that agrees with the measure."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from fracctl.config.compose import compose
from fracctl.execution.run import execute
from fracctl.figures import FigureError, acceleration, approach, draw, position_error
from fracctl.figures.results import Results, select
from fracctl.plants import Chief
from fracctl.store import RunDirectory

SCALES = Chief().scales


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    where = tmp_path_factory.mktemp("flight")
    words = ["horizon_periods=3", "~measures.open_loop_bound", "figures=[]", f"output_dir={where}"]
    return RunDirectory(execute(compose(["experiment=ic1_flight_plots", *words])).run_directory)


@pytest.fixture(scope="module")
def results(run: RunDirectory) -> Results:
    return Results(run)


def test_v_bar_is_to_the_right_and_r_bar_down(results: Results) -> None:
    """IC1 begins 10 km below its chief and moves forward: R-bar +10 km, then V-bar > 0; H-bar is -w, so it falls."""
    figure, _ = approach.build(results, select(results, {}))
    plane, across = figure.axes
    assert plane.yaxis_inverted()
    assert plane.get_aspect() == 1.0
    along, down = np.asarray(plane.lines[0].get_xdata()), np.asarray(plane.lines[0].get_ydata())
    assert (along[0], down[0]) == pytest.approx((0.0, 10.0))
    assert along[200] > 0.5
    assert down[200] < 10.0
    assert np.asarray(across.lines[0].get_ydata())[100] < 0.0
    assert "V-bar" in plane.get_xlabel()
    assert "(km)" in plane.get_xlabel()
    (near,) = plane.child_axes
    (box,) = near.patches
    assert box.get_width() == pytest.approx(0.2), "±100 m, by which the run is judged, in a panel of its own"
    assert near.get_xlim() == pytest.approx((-0.3, 0.3))
    assert any("ticks: 10 min" in text.get_text() for text in plane.texts)


def test_ticks_lie_on_the_path_at_whole_minutes(results: Results) -> None:
    figure, table = approach.build(results, select(results, {}))
    plane = figure.axes[0]
    marks = [line for line in plane.lines if line.get_linestyle() == "None" and isinstance(line.get_marker(), tuple)]
    times = table["time"].to_numpy() * SCALES.time_s / 60.0
    for place, mark in enumerate(marks, start=1):
        expected = [
            np.interp(10.0 * place, times, sign * 1e4 * table[name]) for name, sign in (("v", 1.0), ("u", -1.0))
        ]
        found = float(np.asarray(mark.get_xdata())[0]), float(np.asarray(mark.get_ydata())[0])
        assert found == pytest.approx(expected, abs=5e-3)
    assert len(marks) >= 5


def test_the_approach_is_drawn_until_it_has_settled(results: Results) -> None:
    figure, _ = approach.build(results, select(results, {}))
    across = figure.axes[1]
    best = results.optima[results.optima["kind"] == "overall"].iloc[0]
    assert across.get_xlim()[1] > float(best["settling_time_100_m_orbits"])
    levels = [float(np.asarray(line.get_ydata())[0]) for line in across.lines if line.get_linestyle() == ":"]
    assert levels == pytest.approx([-0.1, 0.1])


def test_a_large_hold_box_is_drawn_in_its_place(run: RunDirectory, tmp_path: Path) -> None:
    content = run.run_json
    content["configuration"]["evaluation"] = {"type": "flight", "band_m": {"ic1": 1000}}
    for name in ("optima.parquet", "trajectories.parquet"):
        (tmp_path / name).symlink_to(run.path / name)
    (tmp_path / "run.json").write_text(json.dumps(content))
    results = Results(RunDirectory(tmp_path))
    plane = approach.build(results, select(results, {}))[0].axes[0]
    (box,) = plane.patches
    assert box.get_width() == pytest.approx(2.0)
    assert not plane.child_axes


def test_distance_is_in_metres_with_all_bands(results: Results) -> None:
    figure, table = position_error.build(results, select(results, {}))
    (ax,) = figure.axes
    assert ax.get_yscale() == "log"
    assert [text.get_text() for text in ax.texts] == ["1 m", "10 m", "30 m", "100 m", "300 m", "1000 m"]
    assert table["distance_m"][0] == pytest.approx(1e4)
    best = results.optima[results.optima["kind"] == "overall"].iloc[0]
    after = table[table["periods"] > float(best["settling_time_100_m_orbits"]) + 1e-3]
    assert (after["distance_m"] < 100.0 * math.sqrt(3.0)).all()


def test_spent_delta_v_is_that_of_the_measure(results: Results) -> None:
    """To 1 %: the trapezoidal rule cuts the corner of υ at the start."""
    figure, table = acceleration.build(results, select(results, {}))
    best = results.optima[results.optima["kind"] == "overall"].iloc[0]
    assert table["delta_v_m_s"].iloc[-1] == pytest.approx(float(best["delta_v_m_s"]), rel=0.01)
    peaks = [table[f"acceleration_{name}_mm_s2"].abs().max() for name in "uvw"]
    assert max(peaks) == pytest.approx(float(best["peak_acceleration_mm_s2"]), rel=0.01)
    assert [ax.get_ylabel() for ax in figure.axes][-1] == r"$\Delta V$ (m/s)"


@pytest.mark.parametrize(
    ("given", "level"),
    [
        ({"evaluation": {"type": "performance", "largest_control": 2e-3}}, 2e-3 * 1e3 * SCALES.acceleration_m_s2),
        ({"evaluation": {"type": "performance", "largest_acceleration_mm_s2": 8.0}}, 8.0),
        ({"spacecraft": {"mass_kg": 500.0, "thrust_n": 4.0, "isp_s": None}}, 8.0),
        ({}, None),
    ],
)
def test_the_bound_is_drawn(run: RunDirectory, tmp_path: Path, given: dict[str, object], level: float | None) -> None:
    content = run.run_json
    content["configuration"] |= given
    for name in ("optima.parquet", "trajectories.parquet"):
        (tmp_path / name).symlink_to(run.path / name)
    (tmp_path / "run.json").write_text(json.dumps(content))
    results = Results(RunDirectory(tmp_path))
    figure, _ = acceleration.build(results, select(results, {}))
    levels = sorted(float(np.asarray(line.get_ydata())[0]) for line in figure.axes[0].lines[2:])
    assert levels == ([] if level is None else pytest.approx([-level, level]))


def test_files_are_written(run: RunDirectory) -> None:
    figures = {name: {"type": name} for name in ("approach", "position_error", "acceleration")}
    assert {path.name for path in draw(run, figures)} == {
        f"{n}.{kind}" for n in figures for kind in ("pdf", "png", "csv")
    }


def test_one_component_has_no_approach(tmp_path: Path) -> None:
    words = ["figures=[]", "horizon_periods=1", f"output_dir={tmp_path}"]
    results = Results(RunDirectory(execute(compose(words)).run_directory))
    with pytest.raises(FigureError, match="three components in the frame rtn"):
        approach.build(results, select(results, {}))


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """One dispersed flight of each law, number 117, beside several noisy ones: thrusters pulse every 10 s."""
    words = ["experiment=flight_ic1", "horizon_periods=1.2", "evaluation.samples=1", "evaluation.first_sample=117"]
    words += ["evaluation.noise_samples=2", "evaluation.stages=[noisy,dispersed]", "initial_condition=[ic1]"]
    words += ["~evaluation.laws.lqr", "~evaluation.laws.pd", "~evaluation.laws.pd_lag", "evaluation.band_m=100"]
    where = tmp_path_factory.mktemp("flown")
    words += ["figures=[]", "scheduler=serial", f"output_dir={where}"]
    return Results(RunDirectory(execute(compose(words)).run_directory))


def test_what_a_flight_spends_and_its_peak_are_those_of_the_measures(flown: Results) -> None:
    figure, table = acceleration.build(flown, select(flown, {}))
    rows = flown.evaluations[flown.evaluations["stage"] == "dispersed"].set_index("law")
    assert len(rows) == 3
    for law, own in table.groupby("kind"):
        peaks = [own[f"acceleration_{name}_mm_s2"].abs().max() for name in "uvw"]
        assert max(peaks) == pytest.approx(rows["peak_acceleration_mm_s2"][law], rel=1e-12)
        assert own["delta_v_m_s"].iloc[-1] == pytest.approx(rows["delta_v_m_s"][law], rel=1e-9)
    assert {line.get_drawstyle() for line in figure.axes[0].lines[:3]} == {"steps-post"}


def test_paths_of_one_flight_by_its_number_are_drawn(flown: Results) -> None:
    for module in (approach, position_error):
        _, table = module.build(flown, select(flown, {}))
        assert set(table["kind"]) == {"published_pd", "published_pd_alpha", "pd_alpha"}
    start = flown.evaluations.query("stage == 'dispersed'").iloc[0]
    distance = float(table["distance_m"].iloc[0])
    offsets = np.array([start[f"offset_{name}_percent"] for name in "uvw"]) * 100.0
    assert distance == pytest.approx(float(np.hypot(np.hypot(offsets[0] - 1e4, offsets[1]), offsets[2])), rel=1e-9)


def test_several_flights_have_no_path_and_the_sentence_says_the_cure(tmp_path: Path) -> None:
    words = ["experiment=flight_ic1", "horizon_periods=0.1", "evaluation.samples=2", "evaluation.stages=[dispersed]"]
    words += ["initial_condition=[ic1]", "evaluation.band_m=100", "figures=[]", f"output_dir={tmp_path}"]
    results = Results(RunDirectory(execute(compose([*words, "scheduler=serial"])).run_directory))
    with pytest.raises(FigureError, match=r"take evaluation.samples=1 evaluation.first_sample=NUMBER"):
        position_error.build(results, select(results, {}))
