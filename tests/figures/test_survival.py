"""The figure of what survives: every law at every stage, and those that never settle above all others."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.config.compose import compose
from fracctl.execution.run import execute
from fracctl.figures import FigureError, spread, survival
from fracctl.figures.results import Results, select
from fracctl.store import RunDirectory
from tests.flight.test_evaluation import SMALL


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    where = tmp_path_factory.mktemp("survival")
    words = [*SMALL, "~evaluation.laws.lqr", "~evaluation.laws.pd_alpha", f"output_dir={where}", "scheduler=serial"]
    return Results(RunDirectory(execute(compose(words)).run_directory))


def test_medians_stand_where_the_table_has_them(results: Results) -> None:
    figure, table = survival.build(results, select(results, {}))
    left, right = figure.axes[0], figure.axes[1]
    own = table[(table["initial_condition"] == "ic1") & (table["law"] == "published_pd")]
    finite = own[np.isfinite(own["median_orbits"])]
    marks = [line for line in left.lines if line.get_marker() == "o" and line.get_markerfacecolor() != "none"]
    assert np.asarray(marks[0].get_ydata()).tolist() == finite["median_orbits"].tolist()
    spent = [line for line in right.lines if line.get_marker() == "o" and line.get_markerfacecolor() != "none"]
    assert np.asarray(spent[0].get_ydata()).tolist() == own["median_delta_v_m_s"].tolist()
    assert left.get_title(loc="left") == "IC1, to 100 m"


def test_what_never_settles_lies_on_the_upper_line(results: Results) -> None:
    figure, table = survival.build(results, select(results, {"initial_conditions": ["ic1_hundredth"]}))
    never = np.isinf(table["median_orbits"])
    assert never.any()
    longest = table["quantile_95_orbits"][np.isfinite(table["quantile_95_orbits"])].max()
    hollow = [line for line in figure.axes[0].lines if line.get_markerfacecolor() == "none" and len(line.get_xdata())]
    heights = np.concatenate([np.asarray(line.get_ydata()) for line in hollow])
    assert len(heights) == never.sum()
    assert (heights > longest).all()


def test_a_spread_is_that_of_one_stage(results: Results) -> None:
    """Of the last, as long as no other is named; times once, not in all their units."""
    figure, table = spread.build(results, select(results, {"initial_conditions": ["ic1"]}))
    assert len(table) == 3 * 4, "samples and laws"
    times = [name for name in table if name.startswith("settling_time")]
    assert times
    assert all(name.endswith("_orbits") for name in times)
    rows = results.evaluations
    there = (rows["stage"] == "dispersed") & (rows["initial_condition"] == "ic1")
    assert sorted(table["settling_time_1000_m_orbits"]) == sorted(rows[there]["settling_time_1000_m_orbits"])
    assert figure.get_suptitle() == "flights dispersed"
    given = {"initial_conditions": ["ic1"], "stage": "noisy", "shows": "delta_v_m_s"}
    _, noisy = spread.build(results, select(results, given))
    there = (rows["stage"] == "noisy") & (rows["initial_condition"] == "ic1")
    assert sorted(noisy["delta_v_m_s"]) == sorted(rows[there]["delta_v_m_s"])
    with pytest.raises(FigureError, match=r"has no flights noisi; it has .*did you mean 'noisy'"):
        spread.build(results, select(results, {"stage": "noisi"}))


def test_other_runs_have_no_flights(tmp_path_factory: pytest.TempPathFactory) -> None:
    where = tmp_path_factory.mktemp("other")
    run = Results(RunDirectory(execute(compose([f"output_dir={where}", "figures=[]"])).run_directory))
    with pytest.raises(FigureError, match="evaluation=flight"):
        survival.build(run, select(run, {}))
