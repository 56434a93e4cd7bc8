"""Figures of delayed feedback: what is on which axis, which colour means what, what is shaded."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

import fracctl
from fracctl.figures import drift, feedback, multiplier_window, orbits, trajectories
from fracctl.figures.results import Results, select
from fracctl.plants import RotatingEllipsoid
from fracctl.store import RunDirectory


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Results]:
    where: Path = tmp_path_factory.mktemp("runs")
    common = [f"output_dir={where}", "horizon_periods=4", "figures=[]"]
    short = [*common, "measures.lyapunov_exponent.periods=5", "measures.lyapunov_exponent.transient_periods=1"]
    runs = {
        "formation": ["initial_condition=[formation_2_km]", *common],
        "ellipsoid_free": ["initial_condition=[rho_1_9,rho_2_0,rho_2_1,rho_2_2]", *common],
        "ellipsoid": ["initial_condition=[rho_1_9]", *common],
        "libration": short,
        "libration_adaptive": ["controller.adapt_from_delays=2", *common],
        "libration_window": ["survey.axes.gain_1_2=[0.15,0.25,0.35]", "survey.axes.recall=[0.0]", *short],
    }
    return {name: Results(RunDirectory(fracctl.run(name, words).run_directory)) for name, words in runs.items()}


def titles(figure: Figure) -> list[str]:
    return [ax.get_title() for ax in figure.axes if ax.axison]


def labels(ax: Axes) -> tuple[str, str]:
    return ax.get_xlabel(), ax.get_ylabel()


def test_relative_motion_flies_to_the_right(results: dict[str, Results]) -> None:
    figure, table = orbits.build(results["formation"], select(results["formation"], {}))
    ax = figure.axes[0]
    assert labels(ax) == ("along-track $y$ (km, frame rtn)", "radial $x$ (km)")
    assert ax.get_aspect() == 1.0
    free = table[table["kind"] == "baseline"]
    assert ax.lines[0].get_xdata() == pytest.approx(6700.0 * free["y"])
    assert ax.lines[0].get_ydata() == pytest.approx(6700.0 * free["x"])
    assert titles(figure) == ["formation 2 km, free motion", "formation 2 km, delayed feedback"]
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["free motion", "start", "under control", "last delay"]


def test_motions_without_a_partner_stand_side_by_side(results: dict[str, Results]) -> None:
    figure, _ = orbits.build(results["ellipsoid_free"], select(results["ellipsoid_free"], {}))
    assert figure.axes[0].get_gridspec().get_geometry() == (2, 3)
    assert len(titles(figure)) == 4
    a, b = RotatingEllipsoid().semi_axes
    (body,) = (patch for patch in figure.axes[0].patches if isinstance(patch, Ellipse))
    assert body.width / body.height == pytest.approx(a / b)
    assert body.width == pytest.approx(2.0 * 17.2)


def test_time_is_named_after_the_plant(results: dict[str, Results]) -> None:
    figure, _ = trajectories.build(results["libration"], select(results["libration"], {}))
    assert labels(figure.axes[0]) == ("True anomaly $\\nu$ (rad)", "tumbling: position $\\varphi$ (rad)")
    figure, _ = feedback.build(results["ellipsoid"], select(results["ellipsoid"], {}))
    assert figure.axes[-1].get_xlabel() == "Time (rotations of the body)"
    assert figure.axes[1].get_ylabel().endswith("m/s²)")


def test_an_adapting_delay_stands_beside_a_fixed_one(results: dict[str, Results]) -> None:
    figure, _ = orbits.build(results["libration_adaptive"], select(results["libration_adaptive"], {}))
    assert set(titles(figure)) == {"tumbling, fixed delay", "tumbling, adaptive delay"}


def test_drift_of_free_and_of_controlled_motion(results: dict[str, Results]) -> None:
    figure, table = drift.build(results["formation"], select(results["formation"], {}))
    assert [line.get_label() for line in figure.axes[0].lines] == ["free motion", "delayed feedback"]
    free = table[(table["kind"] == "baseline") & (table["orbit"] > 0)]["drift"]
    assert free.to_numpy() == pytest.approx(5.62e-3, rel=2e-3), "3π x₀²/r, spec of the paper's second order"


def test_the_window_of_stable_gains_is_shaded(results: dict[str, Results]) -> None:
    figure, _ = multiplier_window.build(results["libration_window"], select(results["libration_window"], {}))
    for ax in figure.axes:
        (span,) = ax.patches
        start, end = span.get_extents().transformed(ax.transData.inverted()).intervalx
        assert 0.15 < start < 0.25
        assert end == pytest.approx(0.35)
