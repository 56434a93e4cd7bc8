"""Pareto fronts: which points are shown, of which law, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from fracctl.figures.pareto_fronts import build
from fracctl.figures.results import FigureError, Results, select
from fracctl.store import RunDirectory

OBJECTIVES = {"settling_time": ["settling_time"], "control_effort": ["control_effort"]}


def results(folder: Path, baseline: dict[str, float], **changes: Any) -> Results:
    """Two fronts y = 1/x and y = 2/x, the second at alpha = 1, each with a copy that is worse by one in y."""
    x = np.tile(np.linspace(0.5, 2.0, 16), 4)
    factor, worse = np.repeat([1.0, 2.0], 32), np.tile(np.repeat([0.0, 1.0], 16), 2)
    rows = {
        "initial_condition": "ic1",
        "alpha_w": np.where(factor == 1.0, 0.9, 1.0),
        "objective_settling_time": x,
        "objective_control_effort": factor / x + worse,
        "status": "ok",
        "searched_for": None,
    }
    pd.DataFrame(rows | changes).to_parquet(folder / "evaluations.parquet")
    configuration = {
        "plant": {"type": "hcw_out_of_plane"},
        "initial_condition": {"ic1": {}},
        "objectives": OBJECTIVES,
        "objective": "settling_time",
        "survey": {"objectives": None, "baseline": baseline},
    }
    (folder / "run.json").write_text(json.dumps({"status": "finished", "configuration": configuration}))
    return Results(RunDirectory(folder))


def test_the_fronts_of_both_laws_without_what_is_worse(tmp_path: Path) -> None:
    found = results(tmp_path, {"alpha_w": 1.0})
    figure, table = build(found, select(found, {}))
    for kind, factor in (("optimum", 1.0), ("baseline", 2.0)):
        front = table[table["kind"] == kind]
        product = front["objective_settling_time"] * front["objective_control_effort"]
        np.testing.assert_allclose(product, np.full(16, factor))
    (panel,) = figure.axes
    assert panel.get_xlabel() == r"Settling time $\mathrm{ST}$ (orbits)"
    lines = [line for line in panel.get_lines() if line.get_drawstyle() == "steps-post"]
    drawn = sorted(float(np.prod([line.get_xdata()[0], line.get_ydata()[0]])) * 2.0 * np.pi for line in lines)
    np.testing.assert_allclose(drawn, [1.0, 2.0])


def test_one_front_without_a_baseline(tmp_path: Path) -> None:
    found = results(tmp_path, {})
    assert set(build(found, select(found, {}))[1]["kind"]) == {"optimum"}


@pytest.mark.parametrize("changes", [{"searched_for": "settling_time"}, {"status": "unsettled"}])
def test_a_run_without_fronts(tmp_path: Path, changes: dict[str, str]) -> None:
    found = results(tmp_path, {}, **changes)
    with pytest.raises(FigureError, match="survey=search_pareto"):
        build(found, select(found, {}))
