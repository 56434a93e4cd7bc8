"""Poles of the optima: what is stored, that two criteria judge them, and what a disagreement does to a run."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fracctl as fc
from fracctl.controllers import PDAlpha
from fracctl.errors import IncompleteRunWarning
from fracctl.evaluation import Evaluation
from fracctl.execution import poles as poles_module
from fracctl.execution.poles import Poles
from fracctl.measures import SettlingTime
from fracctl.plants import HCWOutOfPlane
from fracctl.solvers import Contour
from fracctl.stability import PseudoStateVerdict
from fracctl.store import RunDirectory
from tests.references import loops, poles

SMALL = ["survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=0.5:1:0.1", "survey.axes.k_d_w=1.5:2:0.1"]


def evaluation() -> Evaluation:
    start = {"ic1": np.array([0.0, 0.002])}
    named = {"settling_time": ("settling_time",)}
    return Evaluation(HCWOutOfPlane(), PDAlpha, {}, start, Contour(), (SettlingTime(),), named, "settling_time", 20.0)


def optimum(k_p: float, k_d: float, alpha: float, stable: bool | None, kind: str = "overall") -> dict[str, Any]:
    return {"kind": kind, "alpha_w": alpha, "k_p_w": k_p, "k_d_w": k_d, "stable": stable}


def test_a_run_stores_the_poles_of_its_optima(tmp_path: Path) -> None:
    result = fc.run("ic1_outofplane", [*SMALL, f"output_dir={tmp_path}", "figures=null"])
    table = RunDirectory(result.run_directory).poles()
    for _, row in result.optima.iterrows():
        member = loops.out_of_plane(row["k_p_w"], row["k_d_w"], row["alpha_w"], [0.0, 0.002])
        expected = poles.poles(member)
        assert row["dominant_pole_real"] == pytest.approx(expected.real.max(), rel=1e-9)
        assert row["dominant_pole_imag"] == pytest.approx(expected.imag.max(), rel=1e-9)
        assert row["principal_poles"] == len(expected)
        assert row["all_poles_found"]
        assert row["stable"]
    assert result.summary["stability"]["disagreements"] == 0
    assert result.summary["stability"]["judged_twice"] >= 2
    assert result.summary["optimum"]["dominant_pole_real"] < 0.0
    assert set(table["run"]) == set(result.optima.index[result.optima["kind"] != "slice"])


def test_the_table_holds_poles_and_eigenvalues() -> None:
    found = Poles(evaluation())
    found.add_to([optimum(0.85, 2.0, 0.9, True), optimum(0.55, 2.0, 1.0, True, "baseline")])
    rows = found.rows()
    values = rows["real"] + 1j * rows["imag"]
    sizes = {
        (run, variable): int(np.sum((rows["run"] == run) & (rows["variable"] == variable)))
        for run, variable in itertools.product((0, 1), ("sigma", "w"))
    }
    assert sizes == {(0, "sigma"): 2, (0, "w"): 20, (1, "sigma"): 2, (1, "w"): 2}
    first = (rows["run"] == 0) & (rows["variable"] == "w")
    assert set(rows["denominator"][first]) == {10}
    np.testing.assert_allclose(values[first] ** 20 + 2.0 * values[first] ** 9 + 1.85, 0.0, atol=1e-11)


def test_slices_have_their_dominant_pole_only() -> None:
    found, row = Poles(evaluation()), optimum(0.85, 2.0, 0.9, True, "slice")
    found.add_to([row])
    assert row["dominant_pole_real"] < 0.0 < row["dominant_pole_imag"]
    assert found.rows()["run"].size == 0
    assert found.summary() == {"stability": {"points": 1, "all_poles_found": 1, "judged_twice": 0, "disagreements": 0}}


def test_orders_without_a_common_denominator_are_judged_once() -> None:
    found = Poles(evaluation())
    found.add_to([optimum(0.85, 2.0, np.sqrt(0.5), True)])
    assert set(found.rows()["variable"]) == {"sigma"}
    assert found.summary()["stability"]["judged_twice"] == 0


def test_the_dominant_pole_by_hand() -> None:
    """σ² + k_D σ^α = 0 off the origin: σ^(2-α) = -k_D has |arg σ| = π/(2-α), on the sheet for α < 1."""
    found, rows = Poles(evaluation()), [optimum(-1.0, 1.0, 0.9, None), optimum(-1.0, -1.0, 0.9, False)]
    found.add_to(rows)
    assert [row["principal_poles"] for row in rows] == [2, 1]
    assert rows[0]["dominant_pole_real"] == pytest.approx(np.cos(np.pi / 1.1), rel=1e-12)
    assert rows[1]["dominant_pole_real"] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("alpha", [0.9, 1.0, np.sqrt(0.5)])
def test_a_verdict_that_is_wrong_is_found(alpha: float) -> None:
    found = Poles(evaluation())
    found.add_to([optimum(0.85, -2.0, alpha, True)])
    summary = found.summary()
    assert summary["status"] == "failed"
    assert "k_d_w = -2: stable by the argument principle, but" in summary["error"]


def test_what_is_left_open_is_no_disagreement() -> None:
    found = Poles(evaluation())
    found.add_to([optimum(0.85, 0.0, 0.9, None), optimum(0.85, 2.0, 0.9, None)])
    assert found.disagreements == []


def test_a_run_fails_where_the_criteria_disagree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unstable(loop: fc.ClosedLoop) -> PseudoStateVerdict:
        none = np.zeros(0, dtype=complex)
        return PseudoStateVerdict(stable=False, poles=none, certificate="2 of 2", eigenvalues=none, denominator=1)

    monkeypatch.setattr(poles_module, "matignon", unstable)
    with pytest.warns(IncompleteRunWarning, match="ic1_outofplane: 4 verdicts on stability do not agree"):
        result = fc.run("ic1_outofplane", [*SMALL, f"output_dir={tmp_path}", "figures=null"])
    assert result.status == "failed"
    assert "the pseudo-state matrix finds 2 of 2" in result.summary["error"]
