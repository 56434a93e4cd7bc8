"""A search on the real problem: the same tables whatever the workers, continued where it stopped, and good optima."""

from __future__ import annotations

from pathlib import Path

import pytest

from fracctl.config.compose import compose
from fracctl.execution.run import RunResult, execute
from tests.execution.test_perform import Watch, tables_of

SMALL = [
    "experiment=ic1_inplane_search",
    "measures=standard",
    "horizon_periods=2",
    "survey.starts=5",
    "survey.evaluations=300",
    "survey.population=50",
    "figures=null",
]


def run(folder: Path, *words: str, watch: Watch | None = None) -> RunResult:
    config = compose([*SMALL, *words, f"output_dir={folder}"])
    return execute(config) if watch is None else execute(config, progress=watch)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    return run(tmp_path_factory.mktemp("undisturbed"), "scheduler=serial")


def test_rows_and_optima(undisturbed: RunResult) -> None:
    rows, summary = undisturbed.evaluations, undisturbed.summary
    assert rows["point"].nunique() == 2 * 5
    assert set(rows["searched_for"]) == {"st_os"}
    assert rows["evaluations_spent"].max() <= 300
    assert summary["optimum"]["objective"] <= summary["baseline"]["objective"] < 5.0
    assert summary["baseline"]["alpha_u"] == summary["baseline"]["alpha_v"] == 1.0


def test_the_same_tables_in_two_processes(tmp_path: Path, undisturbed: RunResult) -> None:
    found = run(tmp_path, "scheduler=local", "scheduler.workers=2")
    assert tables_of(found.run_directory) == tables_of(undisturbed.run_directory)


def test_it_continues_where_it_stopped(tmp_path: Path, undisturbed: RunResult) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, "scheduler=serial", watch=Watch(interrupt_after=5))
    found = run(tmp_path, "scheduler=serial")
    assert "0 were stored" not in (found.run_directory / "run.log").read_text()
    assert tables_of(found.run_directory) == tables_of(undisturbed.run_directory)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "objective", "reached"), [("ic1", "st_os", 1.25), ("ic3", "st_u", 0.103)])
def test_optima_of_pd_by_differential_evolution(case: str, objective: str, reached: float, tmp_path: Path) -> None:
    """Gains in [-8, 8], S = 4π, overshoot past the equilibrium; a prototype of other make found these values."""
    words = ["survey.algorithm=differential_evolution", "survey.evaluations=25000", "survey.starts=4"]
    words += ["survey.population=96", "survey.vary=[gains]", "survey.baseline=null", f"objective={objective}"]
    best = run(tmp_path, *words, f"initial_condition={case}").summary["optimum"]
    assert best["objective"] < reached
    assert best["stable"] is True
