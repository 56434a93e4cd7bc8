"""Every kind of survey and of evaluation outlives the death of its process, and `fracctl resume` finishes it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from fracctl.cli.main import main
from fracctl.config.compose import compose
from fracctl.errors import RunError
from fracctl.execution.run import RunResult, execute
from fracctl.execution.worker import Outcome, Work, evaluate
from fracctl.store import RunDirectory
from fracctl.surveys import Block
from tests.comparison.test_comparison import FEW
from tests.configs.test_files import TINY_DESIGN, TINY_FLIGHT
from tests.faults.processes import ROOT, parts_in

SEARCH = [
    *("experiment=ic1_inplane_search", "survey.bounds.gains=[0,4]", "survey.population=50", "survey.evaluations=100"),
    "survey.starts=2",
]
LIBRATION = [
    *("horizon_periods=3", "solver.steps=40", "measures.lyapunov_exponent.periods=2"),
    "measures.lyapunov_exponent.transient_periods=0",
]
TETHER = ["horizon_periods=1", "solver.step=0.02"]
KINDS = {
    "grid": [
        *("experiment=ic1_outofplane", "survey.axes.alpha_w=[0.9,0.95,1.0]", "survey.axes.k_p_w=0:2:0.1"),
        "survey.axes.k_d_w=0:2:0.1",
    ],
    "single": ["controller.alpha_w=0.91", "controller.k_p_w=0.85"],
    "lqr_seed": ["experiment=inplane_lqr"],
    "pattern_search": ["experiment=ic1_inplane", "survey=pattern_search", "survey.steps=[0.5,0.25]"],
    "continuation": [
        *("experiment=ic1_inplane", "survey.axes.alpha_u=[0.99,1.0]", "survey.axes.alpha_v=[0.99,1.0]"),
        *("survey.first_steps=[0.5]", "survey.steps=[0.5]"),
    ],
    "differential_evolution": SEARCH,
    "cma_es": [*SEARCH, "survey.algorithm=cma_es"],
    "nsga2": [*SEARCH, "survey.algorithm=nsga2", "survey.objectives=null"],
    "comparison": ["experiment=fair_outofplane", *FEW],
    "accuracy": [
        *("experiment=solver_accuracy", "survey.axes.alpha_w=[0.9,1.0]", "survey.axes.k_p_w=[0.6]"),
        *("survey.axes.k_d_w=[1.5,2.0]", "evaluation.contour=[1e-8]", "evaluation.volterra=[16]"),
        *("evaluation.collocation=[16]", "evaluation.members=2", "evaluation.repeats=1"),
    ],
    "delayed": [
        "experiment=libration_window",
        *LIBRATION,
        "survey.axes.gain_1_2=[0.2,0.3]",
        "survey.axes.recall=[0,0.3]",
    ],
    "memory": ["experiment=tether", *TETHER],
    "flight": ["experiment=flight_ic1", *TINY_FLIGHT],
    "robust": ["experiment=flight_design", *TINY_DESIGN, "survey.starts=8"],
    "memory, dispersed": ["experiment=tether_monte_carlo", *TETHER, "evaluation.samples=3"],
}
SLOW = {"comparison", "nsga2", "cma_es", "single", "lqr_seed", "accuracy", "memory, dispersed"}
"""Kinds that take long, or that others stand for."""

ONE_BLOCK = {"single", "lqr_seed", "delayed", "memory, dispersed", "flight"}

_KILLED = """
import os, signal, sys
from fracctl.config.compose import compose
from fracctl.execution.progress import NoProgress
from fracctl.execution.run import execute

class Killed(NoProgress):
    def advance(self, points):
        os.kill(os.getpid(), signal.SIGKILL)

execute(compose(sys.argv[1:]), progress=Killed())
"""
_TIMES = ("seconds_per_trajectory",)
"""Columns that are measured, not computed."""


def tables(path: Path) -> dict[str, dict[str, Any]]:
    """All tables of a run but what is measured in seconds, numbers as their bytes."""
    found = {}
    for file in sorted(path.glob("*.parquet")):
        table = pq.read_table(file)
        columns = {name: table.column(name) for name in table.column_names if name not in _TIMES}
        found[file.name] = {
            name: column.to_numpy().tobytes() if str(column.type) in ("double", "int64") else column.to_pylist()
            for name, column in columns.items()
        }
    return found


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The directory of the undisturbed run of each kind, computed when first asked for."""

    @cache
    def directory(kind: str) -> Path:
        return execute(compose([*words_of(kind), f"output_dir={tmp_path_factory.mktemp('whole')}"])).run_directory

    return directory


def words_of(kind: str) -> list[str]:
    return [*KINDS[kind], "figures=[]", "scheduler=serial"]


each_kind = pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.slow] * (kind in SLOW)) for kind in KINDS]
)


@each_kind
def test_a_killed_run_is_resumed(
    kind: str, undisturbed: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words, whole = words_of(kind), undisturbed(kind)
    command = [sys.executable, "-c", _KILLED, *words, f"output_dir={tmp_path / 'killed'}"]
    done = subprocess.run(command, cwd=ROOT, env=os.environ, capture_output=True, text=True, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    (part,) = parts_in(tmp_path / "killed")
    directory = part.parents[1]
    assert main(["validate", str(directory)]) == 1
    assert f"{directory} was stopped in the middle" in capsys.readouterr().err
    moved = tmp_path / "moved"
    directory.rename(moved)
    assert main(["resume", str(moved)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(moved)
    assert "1 were stored, 0 failed" in (moved / "run.log").read_text()
    assert tables(moved) == tables(whole)
    assert RunDirectory(moved).run_json["summary"]["run_id"] == whole.name
    assert main(["validate", str(moved)]) == 0


def assert_not_optimal(found: RunResult, failed: bool) -> None:
    """A run with failed points is incomplete, and none of its optima is one of them."""
    assert found.status == ("incomplete" if failed else "finished")
    rows = found.evaluations[found.evaluations["reason"].notna()]
    assert rows.empty is not failed
    assert found.optima.merge(rows, on=["point", "initial_condition"]).empty


@each_kind
@pytest.mark.parametrize("failing", [0, 1])
def test_failed_blocks_are_tried_again(
    kind: str, failing: int, undisturbed: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a search makes of a failed block does not stay in its path."""

    def fails(work: Work, block: Block) -> Outcome:
        return Outcome(None, "asked for") if block.number == failing else evaluate(work, block)

    whole = undisturbed(kind)
    config = compose([*words_of(kind), f"output_dir={tmp_path}"])
    with monkeypatch.context() as patch:
        patch.setattr("fracctl.execution.scheduler.evaluate", fails)
        if kind in ONE_BLOCK and failing == 0:
            with pytest.raises(RunError, match="every point failed: asked for"):
                execute(config)
        else:
            assert_not_optimal(execute(config), failed=kind not in ONE_BLOCK)
    (directory,) = tmp_path.glob("*/*")
    assert main(["resume", str(directory)]) == 0
    assert tables(directory) == tables(whole)
