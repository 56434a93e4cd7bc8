"""Cross-checks: which rows are solved again, and what a disagreement does to a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fracctl as fc
from fracctl.controllers import PDAlpha
from fracctl.errors import FracctlError
from fracctl.evaluation import Evaluation
from fracctl.execution.cross_check import CrossCheck
from fracctl.measures import SettlingTime
from fracctl.plants import HCWOutOfPlane, LinearPlant
from fracctl.solvers import Contour, Volterra

SMALL = ["survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=0.5:1:0.1", "survey.axes.k_d_w=1.5:2:0.1"]


def evaluation(share: float, plant: LinearPlant | None = None) -> Evaluation:
    return Evaluation(
        plant or HCWOutOfPlane(),
        PDAlpha,
        {},
        {"ic1": np.array([0.0, 0.002]), "ic2": np.array([-0.001, 0.0])},
        Contour(cross_check=share),
        (SettlingTime(),),
        {"settling_time": ("settling_time",)},
        "settling_time",
        4.0 * np.pi,
    )


def rows(of: Evaluation, count: int = 200) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    return of({"alpha_w": np.full(count, 0.9), "k_p_w": rng.uniform(0, 2, count), "k_d_w": rng.uniform(0.5, 2, count)})


def test_the_share_of_rows_is_kept_and_the_solvers_agree() -> None:
    of = evaluation(0.25)
    check = CrossCheck(of, seed=1)
    check.add(rows(of))
    assert 70 <= check.rows <= 130
    assert 0.0 < check.worst < 2e-8
    assert check.disagreements == []
    assert check.summary()["cross_check"]["solver"] == "volterra"


def test_the_choice_does_not_depend_on_how_the_rows_come() -> None:
    of = evaluation(0.1)
    table = rows(of)
    whole, halves = CrossCheck(of, seed=7), CrossCheck(of, seed=7)
    whole.add(table)
    for part in (slice(0, 150), slice(150, 400)):
        halves.add({name: values[part] for name, values in table.items()})
    assert (whole.rows, whole.worst) == (halves.rows, pytest.approx(halves.worst, rel=1e-6))


def test_no_share_means_no_check() -> None:
    of = evaluation(0.0)
    check = CrossCheck(of, seed=1)
    check.add(rows(of))
    assert check.rows == 0
    assert check.summary() == {}
    assert check.notes() == []


def test_unstable_and_failed_rows_are_left_out() -> None:
    of = evaluation(1.0, LinearPlant(stiffness=1.0, components=("w",)))
    table = of({"alpha_w": np.ones(3), "k_p_w": np.array([0.5, 3.0, 3.0]), "k_d_w": np.array([1.0, 1.0, 2.0])})
    check = CrossCheck(of, seed=1)
    check.add(table)
    assert sorted(set(table["status"])) == ["ok", "unstable"]
    assert check.rows == 4


def test_a_wrong_solver_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second solver is handed gains that are off by 1e-6 of their value."""
    solve = Volterra.solve

    def wrong(self: Volterra, loop: fc.ClosedLoop, state: np.ndarray, horizon: float) -> object:
        law = PDAlpha(loop.controller.k_p * (1.0 + 1e-6), loop.controller.k_d, loop.controller.alpha)
        return solve(self, fc.ClosedLoop(loop.plant, law), state, horizon)

    monkeypatch.setattr(Volterra, "solve", wrong)
    of = evaluation(1.0)
    check = CrossCheck(of, seed=1)
    check.add(rows(of, 20))
    assert check.summary()["status"] == "failed"
    assert "contour and volterra differ by" in check.summary()["error"]


def test_a_run_reports_its_cross_check(tmp_path: Path) -> None:
    result = fc.run("ic1_outofplane", [*SMALL, f"output_dir={tmp_path}", "figures=null", "solver.cross_check=0.2"])
    found = result.summary["cross_check"]
    assert found["rows"] >= 6
    assert found["worst_difference"] < 2e-8
    assert any(note.startswith("cross-check:") for note in result.summary["notes"])


def test_a_share_beyond_one_is_refused() -> None:
    with pytest.raises(FracctlError, match=r"cross_check = 1\.5: must lie in \[0, 1\]"):
        fc.run("ic1_outofplane", [*SMALL, "solver.cross_check=1.5"])
