"""Cross-checks: which rows are solved again, and what a disagreement does to a run."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fracctl as fc
from fracctl.controllers import PDAlpha
from fracctl.errors import FracctlError
from fracctl.evaluation import Evaluation
from fracctl.execution.cross_check import CrossCheck
from fracctl.execution.executors import Executors, InProcessExecutor
from fracctl.execution.solving_again import solve_again
from fracctl.execution.worker import Work
from fracctl.plants import LinearPlant
from fracctl.solvers import Volterra
from tests.execution.checked_evaluation import checked as evaluation

SMALL = ["survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=0.5:1:0.1", "survey.axes.k_d_w=1.5:2:0.1"]
LOCAL = {"type": "local", "workers": 2}


@dataclass(frozen=True)
class Ready:
    """Work whose evaluation is built."""

    of: Evaluation

    def evaluation(self) -> Evaluation:
        return self.of


def rows(of: Evaluation, count: int = 200, alpha: float | np.ndarray = 0.9) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    alphas = np.broadcast_to(alpha, count)
    return of({"alpha_w": alphas, "k_p_w": rng.uniform(0, 2, count), "k_d_w": rng.uniform(0.5, 2, count)})


def checked(of: Evaluation, *tables: Mapping[str, np.ndarray], seed: int = 1) -> CrossCheck:
    """A cross-check of tables in this process."""
    executor = InProcessExecutor()
    check = CrossCheck(of, seed, lambda piece: executor.submit(solve_again, Ready(of), piece))
    for table in tables:
        check.add(table)
    check.begin()
    check.finish()
    return check


def checked_by(scheduler: Mapping[str, Any], **data: Any) -> CrossCheck:
    """A cross-check of all rows of some orders by a scheduler."""
    work = Work.of("tests.execution.checked_evaluation:evaluation", {"share": 1.0, **data})
    of = work.evaluation()
    with Executors() as executors, executors.lent(scheduler, n_points=None) as executor:
        check = CrossCheck(of, 1, lambda piece: executor.submit(solve_again, work, piece))
        check.add(rows(of, alpha=np.tile([0.8, 0.85, 0.9, 0.95], 50)))
        check.begin()
        check.finish()
    return check


def test_the_share_of_rows_is_kept_and_the_solvers_agree() -> None:
    of = evaluation(0.25)
    check = checked(of, rows(of))
    assert 70 <= check.rows <= 130
    assert 0.0 < check.worst < 2e-8
    assert check.disagreements == []
    assert check.summary()["cross_check"]["solver"] == "volterra"


def test_the_choice_does_not_depend_on_how_the_rows_come() -> None:
    of = evaluation(0.1)
    table = rows(of)
    halves = ({name: values[part] for name, values in table.items()} for part in (slice(0, 150), slice(150, 400)))
    assert found_by(checked(of, table, seed=7)) == found_by(checked(of, *halves, seed=7))


def found_by(check: CrossCheck) -> tuple[Any, ...]:
    return check.rows, check.worst, check.notes(), check.summary(), check.failures


@pytest.mark.parametrize("workers", [1, 2])
def test_workers_find_what_one_process_finds(workers: int) -> None:
    alone = checked_by({"type": "serial"})
    assert alone.rows == 400
    assert alone.foreign_cpu_time_s == 0.0
    together = checked_by(LOCAL | {"workers": workers})
    assert found_by(together) == found_by(alone)
    assert together.foreign_cpu_time_s > 0.0


def test_equal_orders_stay_together() -> None:
    of = evaluation(1.0)
    sizes: list[dict[float, int]] = []

    def submit(piece: Mapping[str, np.ndarray]) -> Any:
        sizes.append(dict(zip(*map(np.ndarray.tolist, np.unique(piece["alpha_w"], return_counts=True)), strict=True)))
        return InProcessExecutor().submit(solve_again, Ready(of), piece)

    check = CrossCheck(of, 1, submit)
    check.add(rows(of, alpha=np.repeat([0.8, 0.85, 0.9, 0.95], [100, 10, 60, 30])))
    check.begin()
    assert sizes == [{0.8: 200}, {0.85: 20, 0.9: 120}, {0.95: 60}]


@pytest.mark.parametrize("kind", ["is killed", "exits at once"])
def test_rows_whose_worker_dies_are_solved_again(tmp_path: Path, kind: str) -> None:
    fault = {"kind": kind, "alpha_w": 0.85, "parent": os.getpid(), "once": str(tmp_path / "once")}
    assert found_by(checked_by(LOCAL, fault=fault)) == found_by(checked_by({"type": "serial"}))
    assert (tmp_path / "once").exists()


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("is killed", "its worker process was killed by signal 9"),
        ("raises", "ValueError: the fault was asked for"),
        ("exits", "SystemExit: 3"),
    ],
)
def test_rows_that_cannot_be_solved_again_fail_the_run(kind: str, reason: str) -> None:
    check = checked_by(LOCAL, fault={"kind": kind, "alpha_w": 0.85, "parent": os.getpid()})
    assert check.rows == 300, "the other pieces"
    assert check.summary()["status"] == "failed"
    error = f"the cross-check could not be completed ({reason}); the same command tries it again"
    assert check.summary()["error"] == error


def test_no_share_means_no_check() -> None:
    of = evaluation(0.0)
    check = checked(of, rows(of))
    assert check.rows == 0
    assert check.summary() == {}
    assert check.notes() == []


def test_unstable_and_failed_rows_are_left_out() -> None:
    of = evaluation(1.0, LinearPlant(stiffness=1.0, components=("w",)))
    table = of({"alpha_w": np.ones(3), "k_p_w": np.array([0.5, 3.0, 3.0]), "k_d_w": np.array([1.0, 1.0, 2.0])})
    assert sorted(set(table["status"])) == ["ok", "unstable"]
    assert checked(of, table).rows == 4


def test_a_wrong_solver_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second solver is handed gains that are off by 1e-6 of their value."""
    solve = Volterra.solve

    def wrong(self: Volterra, loop: fc.ClosedLoop, state: np.ndarray, horizon: float) -> object:
        law = PDAlpha(loop.controller.k_p * (1.0 + 1e-6), loop.controller.k_d, loop.controller.alpha)
        return solve(self, fc.ClosedLoop(loop.plant, law), state, horizon)

    monkeypatch.setattr(Volterra, "solve", wrong)
    of = evaluation(1.0)
    check = checked(of, rows(of, 20))
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
