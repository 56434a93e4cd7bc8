"""Constraints of a run on measured columns: no optimum breaks them, and the summary says where none is left."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.evaluation import BEYOND_LIMITS
from fracctl.execution.run import execute
from fracctl.measures.limits import Limit, excess, limit

LEAST = 80.0
OUT_OF_PLANE = ["measures=margins", f'constraints.phase_margin_deg=">= {LEAST}"', "figures=null", "scheduler=serial"]
SURVEYS = {
    "grid": [
        *("survey=out_of_plane", 'survey.axes.alpha_w="0.9:1:0.05"'),
        *('survey.axes.k_p_w="0.1:1.1:0.25"', 'survey.axes.k_d_w="1:2:0.25"'),
    ],
    "pattern_search": [
        *("survey=pattern_search", "survey.lqr=null", "survey.steps=[0.5,0.1]"),
        *("controller.alpha_w=0.95", "controller.k_p_w=0.2", "controller.k_d_w=2.0"),
    ],
    "search": [
        *("survey=search", "survey.bounds.gains=[0,2]", "survey.evaluations=320", "survey.starts=2"),
        "survey.population=16",
    ],
}


@pytest.mark.parametrize("name", SURVEYS)
def test_an_optimum_keeps_to_the_constraints(name: str, tmp_path: Path) -> None:
    """Without the constraint the best of PD^α has a phase margin of 71° to 78°."""
    result = execute(compose([*OUT_OF_PLANE, *SURVEYS[name], f"output_dir={tmp_path}"]))
    rows = result.evaluations
    kept = rows["phase_margin_deg"] >= LEAST
    assert set(rows.loc[~kept & (rows["stable"] == True), "status"]) <= {BEYOND_LIMITS, "unsettled"}  # noqa: E712
    assert BEYOND_LIMITS not in set(rows.loc[kept, "status"])
    assert (result.optima["phase_margin_deg"] >= LEAST).all()
    best = result.summary["optimum"]
    assert best["settling_time"] == rows.loc[kept & (rows["status"] == "ok"), "settling_time"].min()


def test_no_point_within_the_constraints_gets_a_sentence(tmp_path: Path) -> None:
    words = [*OUT_OF_PLANE, *SURVEYS["grid"], f"output_dir={tmp_path}", 'constraints.sensitivity_peak="<= 0.5"']
    result = execute(compose(words))
    assert result.summary["optimum"] is None
    (note,) = [note for note in result.summary["notes"] if "no optimum of settling_time for ic1" in note]
    assert BEYOND_LIMITS in note
    assert "keeps to all constraints" in note


def test_limits() -> None:
    assert limit(">= 45") == Limit(45.0, True)
    assert limit("<=1.4e0") == Limit(1.4, False)
    values = np.array([30.0, 45.0, 60.0, np.nan, np.inf])
    np.testing.assert_allclose(limit(">= 45").excess(values), [1.0 / 3.0, 0.0, 0.0, np.inf, 0.0])
    np.testing.assert_allclose(limit("<= 45").excess(values), [0.0, 0.0, 1.0 / 3.0, np.inf, np.inf])
    both = {"a": limit(">= 45"), "b": limit("<= 0")}
    rows = {"a": np.array([30.0, 60.0]), "b": np.array([0.5, -1.0])}
    np.testing.assert_allclose(excess(rows, both), [1.0 / 3.0 + 0.5, 0.0])


@pytest.mark.parametrize("text", ["45", "> 45", ">= many", ">= inf", ""])
def test_a_limit_is_a_comparison_with_a_number(text: str) -> None:
    with pytest.raises(ArgumentError, match="must be '>= number' or '<= number'"):
        limit(text)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (['constraints.phase_margin_de=">= 4"'], "did you mean 'constraints.phase_margin_deg'?"),
        (["survey=search", "survey.constraints.overshoot=4"], "set 'constraints.COLUMN=\"<= NUMBER\"'"),
        (["survey=out_of_plane", "+survey.constraints.overshoot=4"], "limits belong to the run, not to its survey"),
        (['constraints.phase_margin_deg="> 4"'], "must be '>= number' or '<= number', in quotes"),
        (["plant=hcw_in_plane", "controller=pd_in_plane"], "is made for 1 control, but hcw_in_plane has 2"),
        (["evaluation=comparison", "survey=comparison"], "needs evaluation=performance"),
    ],
)
def test_mistakes(words: list[str], sentence: str) -> None:
    with pytest.raises(ConfigurationError, match=sentence.replace("?", r"\?")):
        build_checked(compose(["measures=margins", *words]))
