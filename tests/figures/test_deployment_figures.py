"""Figures of tethers: what is on which axis, where the targets are, what is refused."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

import fracctl
from fracctl.figures import deployment, settling_against_overshoot, spread
from fracctl.figures.results import FigureError, Results, select
from fracctl.plants import Tether
from fracctl.store import RunDirectory


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Results]:
    where: Path = tmp_path_factory.mktemp("runs")
    common = [f"output_dir={where}", "solver.step=0.02", "figures=[]", "scheduler=serial"]
    runs = {
        "tether": ["horizon_periods=1", *common],
        "tether_eccentric": ["horizon_periods=1", *common],
        "tether_causes": ["horizon_periods=0.5", *common],
        "tether_retrieval": ["survey.axes.reference_rate=[0.0,0.7]", "horizon_periods=3", *common],
        "tether_station_keeping": ["horizon_periods=1", *common],
        "tether_orders": ["survey.axes.alpha_1=[0.0,0.3,0.5]", "survey.axes.nu=[0.4,0.5]", *common],
        "tether_monte_carlo": ["evaluation.samples=4", "horizon_periods=1", *common],
    }
    return {name: Results(RunDirectory(fracctl.run(name, words).run_directory)) for name, words in runs.items()}


def shown(results: Results, **options: object) -> tuple[list[Axes], pd.DataFrame]:
    figure, table = deployment.build(results, select(results, options))
    return figure.axes, table


def drawn(ax: Axes) -> dict[str, np.ndarray]:
    return {str(line.get_label()): np.asarray(line.get_xydata()) for line in ax.lines if line.get_label()[0] != "_"}


def test_the_length_of_each_law_and_its_approach(results: dict[str, Results]) -> None:
    (whole, close), table = shown(results["tether"])
    assert (whole.get_xlabel(), whole.get_ylabel()) == (r"True anomaly $f/2\pi$ (orbits)", r"Length $\lambda$")
    assert list(drawn(whole)) == ["FDA-SMC", "DA-SMC", "FO-SMC (reconstruction)"]
    assert close.get_ylim() == pytest.approx((1.0 - 0.05 * 0.9991, 1.0 + 0.05 * 0.9991))
    (band,) = close.patches
    assert band.get_extents().transformed(close.transData.inverted()).intervaly == pytest.approx(
        (1.0 - 0.02 * 0.9991, 1.0 + 0.02 * 0.9991)
    )
    assert list(table) == ["initial_condition", "curve", "orbits", "periods", "length"]
    last = table.groupby("curve", sort=False)["orbits"].max()
    assert last.to_numpy() == pytest.approx(1.0)


def test_the_settling_time_is_where_the_curve_enters_the_band(results: dict[str, Results]) -> None:
    (_, close), _ = shown(results["tether"])
    orbits, length = drawn(close)["FDA-SMC"].T
    outside = np.abs(length - 1.0) > 0.02 * 0.9991
    rows = results["tether"].optima
    settling = rows[rows["law"] == "FDA-SMC"]["settling_2_percent_orbits"].iloc[0]
    assert orbits[outside].max() == pytest.approx(settling, abs=2.0 / 1000.0)


def test_the_target_of_a_retrieval_is_what_is_asked_for(results: dict[str, Results]) -> None:
    (whole, close), _ = shown(results["tether_retrieval"])
    assert list(drawn(whole)) == ["$c = 0$", "$c = 0.7$"]
    assert close.get_ylim() == pytest.approx((0.1 - 0.045, 0.1 + 0.045))
    assert len(close.patches) == 1, "one band for all, though no approach is quite there"
    crosses = [line for line in whole.lines if line.get_marker() == "x"]
    assert len(crosses) == 1, "the step ends with the satellites meeting"
    assert crosses[0].get_ydata()[0] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("shows", ["length_dot", "theta", "phi"])
def test_rates_and_angles_are_led_to_zero(results: dict[str, Results], shows: str) -> None:
    (whole, close), table = shown(results["tether"], shows=shows)
    low, high = close.get_ylim()
    assert low == -high
    assert high == pytest.approx(0.05 * abs(table[shows].iloc[0]))
    assert "rad" in whole.get_ylabel() or shows == "length_dot"
    assert len(close.patches) == 0


def test_an_angle_that_begins_at_rest_is_seen(results: dict[str, Results]) -> None:
    (_, close), table = shown(results["tether_retrieval"], shows="phi")
    later = table[table["orbits"] > 1.5]["phi"].abs().max()
    assert later <= close.get_ylim()[1] <= 1.2 * later


def test_a_length_that_is_kept_has_its_band(results: dict[str, Results]) -> None:
    (_, close), _ = shown(results["tether_station_keeping"])
    assert close.get_ylim() == pytest.approx((0.95, 1.05))
    (band,) = close.patches
    assert band.get_extents().transformed(close.transData.inverted()).intervaly == pytest.approx((0.98, 1.02))


def test_the_tension_with_its_bounds(results: dict[str, Results]) -> None:
    (whole, close), table = shown(results["tether"], shows="tension")
    bounds = [line.get_ydata()[0] for line in whole.lines if line.get_linestyle() == "--"]
    assert bounds == pytest.approx([0.1, 5.0])
    assert close.get_xlim() == pytest.approx((0.0, 0.2))
    assert table["tension"].min() >= 0.1 - 1e-12
    assert table["tension"].max() <= 5.0 + 1e-12


def test_time_is_told_where_it_differs_from_the_true_anomaly(results: dict[str, Results]) -> None:
    axes, table = shown(results["tether_eccentric"])
    for ax in axes:
        (top,) = ax.child_axes
        assert top.get_xlabel() == "Time $t/T$ (orbital periods)"
    quarter = table.iloc[(table["orbits"] - 0.25).abs().argmin()]
    anomaly = math.acos(0.17)  # of the eccentric anomaly at f = π/2, where its cosine is e
    assert quarter["periods"] == pytest.approx((anomaly - 0.17 * math.sin(anomaly)) / math.tau, abs=1e-3)
    assert Tether(eccentricity=0.17).orbits(np.pi) / 0.5 == pytest.approx(1.0)
    axes, _ = shown(results["tether"])
    assert len(axes[0].child_axes) == 0, "at e = 0.0027 they are the same to the eye"


def test_variants_that_lie_on_a_law_are_dashed(results: dict[str, Results]) -> None:
    (whole, _), _ = shown(results["tether_causes"])
    styles = [line.get_linestyle() for line in whole.lines if line.get_label()[0] != "_"]
    assert styles == ["-", "-", "-", "--", "--", "--"]


def test_what_a_deployment_cannot_show(results: dict[str, Results]) -> None:
    with pytest.raises(FigureError, match=r"shows = lenth: must be one of length, .*; did you mean 'length'\?"):
        shown(results["tether"], shows="lenth")


def test_settling_against_overshoot(results: dict[str, Results]) -> None:
    run = results["tether_orders"]
    figure, table = settling_against_overshoot.build(run, select(run, {}))
    left, right = figure.axes[:2]
    assert (left.get_xlabel(), left.get_ylabel()) == ("Settling to 2 % (orbits)", "Overshoot (%)")
    assert (right.get_xlabel(), right.get_ylabel()) == (r"$\alpha_1$", r"$\nu$")
    assert "Margin of the demanded tension" in [ax.get_ylabel() for ax in figure.axes]
    front = np.asarray(left.lines[0].get_xydata())
    assert (np.diff(front[:, 0]) > 0).all()
    assert (np.diff(front[:, 1]) < 0).all()
    best = table.loc[table["settling_2_percent_orbits"].idxmin()]
    assert right.lines[0].get_xydata()[0].tolist() == [best["alpha_1"], best["nu"]]


def test_a_point_that_another_one_beats_is_not_on_the_front() -> None:
    rows = pd.DataFrame({"settling_2_percent_orbits": [2.0, 1.0, 3.0, 1.0], "overshoot_percent": [5.0, 5.0, 1.0, 6.0]})
    front = settling_against_overshoot.front_of(rows)
    assert front.to_numpy().tolist() == [[1.0, 5.0], [3.0, 1.0]]


def test_settling_against_overshoot_wants_two_parameters(results: dict[str, Results]) -> None:
    run = results["tether_retrieval"]
    with pytest.raises(FigureError, match="the survey varies 1 parameters; two are drawn"):
        settling_against_overshoot.build(run, select(run, {}))


def test_the_share_of_samples_up_to_each_value(results: dict[str, Results]) -> None:
    run = results["tether_monte_carlo"]
    figure, table = spread.build(run, select(run, {"shows": "overshoot_percent, settling_2_percent_orbits"}))
    left, right = figure.axes
    assert (left.get_xlabel(), right.get_xlabel()) == ("Overshoot (%)", "Settling to 2 % (orbits)")
    assert left.get_ylabel() == "Share of samples"
    curves = drawn(left)
    assert list(curves) == ["FDA-SMC", "DA-SMC"]
    own = table[table["law"] == "DA-SMC"]["overshoot_percent"]
    assert curves["DA-SMC"].tolist() == [[value, share / 4] for share, value in enumerate(sorted(own), 1)]
    assert list(table) == ["sample", "initial_condition", "law", "overshoot_percent", "settling_2_percent_orbits"]


def test_measures_that_vary_without_a_choice(results: dict[str, Results]) -> None:
    run = results["tether_monte_carlo"]
    figure, table = spread.build(run, select(run, {}))
    assert len([ax for ax in figure.axes if ax.axison]) == 6
    assert not {"initial_theta", "disturbance_phase", "error_estimate", "nodes"} & set(table)


def test_samples_that_never_settle_are_missing_at_the_top(results: dict[str, Results], tmp_path: Path) -> None:
    folder = shutil.copytree(results["tether_monte_carlo"].run.path, tmp_path / "run")
    rows = pd.read_parquet(folder / "evaluations.parquet")
    rows.loc[rows["sample"] == 0, "settling_2_percent_orbits"] = np.inf
    rows.to_parquet(folder / "evaluations.parquet", write_page_checksum=True)
    edited = Results(RunDirectory(folder))
    figure, _ = spread.build(edited, select(edited, {"shows": "settling_2_percent_orbits"}))
    assert drawn(figure.axes[0])["FDA-SMC"][-1, 1] == 0.75


def test_what_a_spread_cannot_show(results: dict[str, Results]) -> None:
    with pytest.raises(FigureError, match="the run is not dispersed"):
        spread.build(results["tether"], select(results["tether"], {}))
    run = results["tether_monte_carlo"]
    with pytest.raises(FigureError, match=r"does not measure overshot_percent; did you mean 'overshoot_percent'\?"):
        spread.build(run, select(run, {"shows": "overshot_percent"}))
