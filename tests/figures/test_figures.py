"""Figures of a stored run: what they show, what they refuse, and that they are the same every time."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

from fracctl.errors import ConfigurationError
from fracctl.figures import (
    FigureError,
    draw,
    gain_contours,
    objective_against_order,
    order_contours,
    trajectories,
)
from fracctl.figures.results import Results, select
from fracctl.figures.style import style
from fracctl.store import RunDirectory
from tests.figures.synthetic import HORIZON_PERIODS, THRESHOLD, write_run

ALL = {name: {"type": name} for name in ("gain_contours", "trajectories", "objective_against_order")}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    return RunDirectory(write_run(tmp_path_factory.mktemp("run"), names=("ic1", "ic2")))


@pytest.fixture
def edit(tmp_path: Path) -> Callable[..., RunDirectory]:
    """A fresh run whose survey is changed."""

    def build(**survey: object) -> RunDirectory:
        folder = write_run(tmp_path / "run")
        content = json.loads((folder / "run.json").read_text())
        content["configuration"]["survey"] |= survey
        (folder / "run.json").write_text(json.dumps(content))
        return RunDirectory(folder)

    return build


def line_xy(ax: Axes, marker: str) -> list[tuple[float, float]]:
    return [
        (float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in ax.lines if line.get_marker() == marker
    ]


def test_every_figure_is_written_in_three_forms(run: RunDirectory) -> None:
    paths = draw(run, ALL)
    assert {path.name for path in paths} == {f"{name}.{kind}" for name in ALL for kind in ("pdf", "png", "csv")}
    assert {path.parent for path in paths} == {run.figures}
    for path in paths:
        head = {"pdf": b"%PDF", "png": b"\x89PNG", "csv": b"initial_condition"}
        assert path.suffix == ".csv" or path.read_bytes().startswith(head[path.suffix[1:]])
    assert not list(run.figures.glob("*.tmp"))


def test_files_are_the_same_whatever_the_users_settings_are(run: RunDirectory) -> None:
    before = {path: path.read_bytes() for path in draw(run, ALL)}
    with mpl.rc_context({"font.size": 20.0, "lines.linewidth": 9.0, "savefig.dpi": 30.0}):
        after = {path: path.read_bytes() for path in draw(run, ALL)}
        assert mpl.rcParams["font.size"] == 20.0
    assert after == before


def test_files_carry_no_dates_and_only_embedded_fonts(run: RunDirectory) -> None:
    for path in draw(run, {"order": {"type": "objective_against_order"}}):
        content = path.read_bytes()
        assert b"CreationDate" not in content
        assert b"/Type3" not in content


def test_drawing_leaves_pyplot_alone() -> None:
    program = "import sys, fracctl.figures; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_contours_mark_the_optima_and_hide_what_does_not_settle(run: RunDirectory) -> None:
    results = Results(run)
    with style():
        figure, table = gain_contours.build(results, select(results, {"initial_conditions": ["ic1"]}))
    optima = results.optima.query("initial_condition == 'ic1' and objective_name == 'settling_time'")
    for ax, kind in zip(figure.axes, ("baseline", "overall"), strict=False):
        (best,) = optima[optima["kind"] == kind].to_dict("records")
        assert line_xy(ax, "*") == [(best["k_p_w"], best["k_d_w"])]
        assert f"{best['settling_time'] / (2 * np.pi):#.4g}" in ax.get_title()
    assert set(table["alpha_w"]) == {0.96, 1.0}
    assert table["optimum"].sum() == 2
    assert np.isinf(table.loc[table["status"] == "unsettled", "objective_settling_time"]).all()
    assert len(table) == 2 * 9 * 9


@pytest.mark.parametrize("values", [[0.48, 6.0], [0.17, 0.171], [1.0, 1.0], [-1.0, 2.0], [0.3, 900.0], [0.0, 0.0]])
def test_levels_increase_and_hold_the_optimum(values: list[float]) -> None:
    levels = gain_contours._levels(np.array(values))
    assert (np.diff(levels) > 0.0).all()
    assert levels[0] <= min(values)
    assert levels[-1] >= min(max(values), 10.0 * min(values))
    assert 2 <= len(levels) <= 30


def test_trajectories_settle_at_their_stars(run: RunDirectory) -> None:
    results = Results(run)
    with style():
        figure, table = trajectories.build(results, select(results, {"initial_conditions": ["ic2"]}))
    left, right = figure.axes[:2]
    stars = line_xy(inset(left), "*")
    shown = results.optima.query("initial_condition == 'ic2' and objective_name == 'settling_time' and kind != 'slice'")
    assert {time for time, _ in stars} == set(shown["settling_time"])
    assert line_xy(right, "*") == []
    for _, place in stars:
        assert abs(place) == pytest.approx(THRESHOLD, rel=0.1)
    assert set(table["kind"]) <= {"baseline", "overall"}
    assert table["time"].max() == pytest.approx(2 * np.pi * HORIZON_PERIODS)
    np.testing.assert_allclose(table["periods"], table["time"] / (2 * np.pi), rtol=1e-15)


def inset(ax: Axes) -> Axes:
    (found,) = [child for child in ax.child_axes if child.lines]
    return found


def test_axes_show_si_units_beside_dimensionless_ones(run: RunDirectory) -> None:
    results = Results(run)
    with style():
        figure, _ = trajectories.build(results, select(results, {"initial_conditions": ["ic2"]}))
        figure.draw_without_rendering()
    left, right = figure.axes[:2]
    labels = [child.get_ylabel() for ax in (left, right) for child in ax.child_axes]
    assert "$w\\,r$ (km)" in labels
    assert "$\\upsilon_{w}\\,rn^2$ (mm/s²)" in labels
    (outer,) = [child for child in left.child_axes if "km" in child.get_ylabel()]
    kilometres_per_unit = np.divide(outer.get_ylim(), np.multiply(left.get_ylim(), 1e-3))
    np.testing.assert_allclose(kilometres_per_unit, 1e4)


def test_a_plant_with_two_components_has_two_rows_of_panels(tmp_path: Path) -> None:
    folder = write_run(tmp_path)
    table = pd.read_parquet(folder / "trajectories.parquet")
    columns = {
        "u": "w",
        "v": "w",
        "u_dot": "w_dot",
        "v_dot": "w_dot",
        "control_u": "control_w",
        "control_v": "control_w",
    }
    planar = table[["run", "time"]].assign(**{new: table[old] for new, old in columns.items()})
    planar["v"] *= 0.1
    planar.to_parquet(folder / "trajectories.parquet")
    results = Results(RunDirectory(folder))
    with style():
        figure, _ = trajectories.build(results, select(results, {}))
    u, _, v, _ = figure.axes
    assert "position $u$" in u.get_ylabel()
    assert "position $v$" in v.get_ylabel()
    assert line_xy(inset(u), "*")
    assert not line_xy(v, "*"), "the settling time is that of u"


def test_settling_times_are_shown_in_orbits(run: RunDirectory) -> None:
    results = Results(run)
    with style():
        figure, table = objective_against_order.build(results, select(results, {"initial_conditions": ["ic1"]}))
    (ax,) = figure.axes
    np.testing.assert_allclose(ax.lines[0].get_ydata(), table["settling_time"] / (2 * np.pi), rtol=1e-15)
    assert figure.get_supylabel() == r"Settling time $\mathrm{ST}$ (orbits)"


def test_objective_against_order_shows_every_slice(run: RunDirectory) -> None:
    results = Results(run)
    selection = select(results, {"objective": "st_os_u"})
    with style():
        figure, table = objective_against_order.build(results, selection)
    for ax, name in zip(figure.axes, ("ic1", "ic2"), strict=True):
        rows = table[table["initial_condition"] == name]
        np.testing.assert_array_equal(ax.lines[0].get_xdata(), [0.96, 1.0])
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), rows["objective_st_os_u"])
        best = rows.loc[rows["objective_st_os_u"].idxmin()]
        assert line_xy(ax, "*") == [(best["slice"], best["objective_st_os_u"])]


def bowl_over_orders(folder: Path) -> RunDirectory:
    """A run with optima for slices of two orders: 2 at (0.93, 0.95), 2.74 at (1, 1), none at (0.9, 0.9)."""
    write_run(folder)
    u, v = (axis.ravel() for axis in np.meshgrid(np.linspace(0.9, 1.0, 11), np.linspace(0.9, 1.0, 11)))
    value = 2.0 + 100.0 * ((u - 0.93) ** 2 + (v - 0.95) ** 2)
    rows = {"initial_condition": "ic1", "alpha_u": u, "alpha_v": v, "settling_time": value, "status": "ok"}
    slices = pd.DataFrame(
        {"kind": "slice", "objective_name": "settling_time", **rows, "objective_settling_time": value}
    )
    slices = slices[(u > 0.9) | (v > 0.9)]
    best, base = (
        slices.loc[[slices["settling_time"].idxmin()]],
        slices[(slices["alpha_u"] == 1.0) & (slices["alpha_v"] == 1.0)],
    )
    kinds = [best.assign(kind="overall"), base.assign(kind="baseline"), slices]
    pd.concat(kinds, ignore_index=True).to_parquet(folder / "optima.parquet")
    return RunDirectory(folder)


def test_contours_over_orders_mark_the_best_and_the_baseline(tmp_path: Path) -> None:
    results = Results(bowl_over_orders(tmp_path))
    with style():
        figure, table = order_contours.build(results, select(results, {}))
    ax = figure.axes[0]
    assert line_xy(ax, "*") == [(pytest.approx(0.93), pytest.approx(0.95))]
    assert line_xy(ax, "D") == [(pytest.approx(1.0), pytest.approx(1.0))]
    assert ax.get_title().startswith("IC1: 0.3183 at (0.93, 0.95), −27.0 %")
    assert len(table) == 120
    assert table.iloc[0][["alpha_u", "alpha_v"]].tolist() == pytest.approx([0.9, 0.91])


def test_contours_over_orders_need_two_orders(run: RunDirectory) -> None:
    with pytest.raises(FigureError, match="this run varies alpha_w"):
        draw(run, {"orders": {"type": "order_contours"}})


@pytest.mark.parametrize(
    ("survey", "name", "sentence"),
    [
        ({"axes": {"alpha_w": [0.96, 1.0]}}, "gain_contours", "this run varies none"),
        ({"axes": {"alpha_w": [0.96, 1.0], "k_p_w": "0:2:0.25"}}, "gain_contours", "this run varies k_p_w"),
    ],
)
def test_what_cannot_be_drawn_gets_a_sentence(
    edit: Callable[..., RunDirectory], survey: dict[str, object], name: str, sentence: str
) -> None:
    run = edit(**survey)
    with pytest.raises(FigureError, match=sentence) as refusal:
        draw(run, ALL)
    assert f"figure '{name}'" in str(refusal.value)
    drawn = {path.stem for path in run.figures.iterdir()}
    assert drawn == set(ALL) - {name}, "the other figures are there all the same"


def test_a_survey_without_slices_has_nothing_to_draw_against(edit: Callable[..., RunDirectory]) -> None:
    with pytest.raises(FigureError, match="the survey has no `slice`"):
        draw(edit(slice=None), {"order": {"type": "objective_against_order"}})


def test_a_run_without_optima_gets_a_sentence(tmp_path: Path) -> None:
    folder = write_run(tmp_path)
    for table in ("optima", "trajectories"):
        path = folder / f"{table}.parquet"
        pd.read_parquet(path).iloc[:0].to_parquet(path)
    with pytest.raises(FigureError) as refusal:
        draw(RunDirectory(folder), ALL)
    assert len(str(refusal.value).splitlines()) == len(ALL)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"type": "gain_contour"}, "figures.x.type = gain_contour: .*did you mean 'gain_contours'"),
        ({}, "figures.x.type = None"),
        ({"type": "trajectories", "objectives": "st_os_u"}, "figures.x: unknown option 'objectives'; did you mean"),
        ({"type": "trajectories", "objective": "st_os"}, "no objective 'st_os'; did you mean 'st_os_u'"),
        ({"type": "trajectories", "initial_conditions": ["ic7"]}, "no initial condition 'ic7'"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_drawn(
    tmp_path: Path, options: dict[str, object], sentence: str
) -> None:
    run = RunDirectory(write_run(tmp_path))
    with pytest.raises(ConfigurationError, match=sentence):
        draw(run, {"fine": {"type": "trajectories"}, "x": options})
    assert not run.figures.exists()
