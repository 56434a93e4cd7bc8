"""The paper's in-plane survey: the same result whatever the workers, continued where it stopped, and its optima."""

from __future__ import annotations

from pathlib import Path

import pytest

from fracctl.config.compose import compose
from fracctl.execution.run import RunResult, execute
from tests.execution.test_perform import Watch, tables_of

CORNER = [
    "experiment=ic1_inplane",
    "survey.axes.alpha_u=[0.98,0.99,1.0]",
    "survey.axes.alpha_v=[0.99,1.0]",
    "solver.cross_check=0",
    "figures=null",
]


def run(folder: Path, *words: str, watch: Watch | None = None) -> RunResult:
    config = compose([*CORNER, *words, f"output_dir={folder}"])
    return execute(config) if watch is None else execute(config, progress=watch)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    return run(tmp_path_factory.mktemp("undisturbed"), "scheduler=serial")


def test_the_seed_is_the_first_row_of_each_track(undisturbed: RunResult) -> None:
    rows = undisturbed.evaluations
    seed = {"k_p_u": 4.0, "k_p_uv": -0.95, "k_p_vu": 3.0, "k_p_v": 0.3, "k_d_u": 2.4, "k_d_v": 1.95}
    for _, track in rows.groupby("searched_for"):
        assert {name: track[name].iloc[0] for name in seed} == seed
        assert track["evaluations_spent"].iloc[0] == 1
    assert rows["point"].nunique() == 2 * (1 + 3 + 2 * 2)


def test_every_order_is_at_least_as_good_as_where_its_searches_started(undisturbed: RunResult) -> None:
    rows, optima = undisturbed.evaluations, undisturbed.optima
    for name in ("st_os", "st_u"):
        starts = rows[rows["searched_for"] == name].groupby("point").first()
        slices = optima[(optima["kind"] == "slice") & (optima["objective_name"] == name)]
        best = slices.set_index(["alpha_u", "alpha_v"])[f"objective_{name}"]
        assert len(best) == 6
        for _, start in starts.iterrows():
            assert best[start["alpha_u"], start["alpha_v"]] <= start[f"objective_{name}"]


@pytest.mark.parametrize("workers", [1, 2])
def test_the_same_tables_whatever_the_workers(tmp_path: Path, undisturbed: RunResult, workers: int) -> None:
    found = run(tmp_path, "scheduler=local", f"scheduler.workers={workers}")
    assert tables_of(found.run_directory) == tables_of(undisturbed.run_directory)


@pytest.mark.parametrize("after", [1, 5, 15])
def test_it_continues_where_it_stopped(tmp_path: Path, undisturbed: RunResult, after: int) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, "scheduler=serial", watch=Watch(interrupt_after=after))
    found = run(tmp_path, "scheduler=serial")
    (*_, last) = [line for line in (found.run_directory / "run.log").read_text().splitlines() if "blocks:" in line]
    assert "8 blocks:" in last
    assert "0 were stored" not in last
    assert tables_of(found.run_directory) == tables_of(undisturbed.run_directory)


def test_rows_of_paths_are_checked_by_a_second_solver(tmp_path: Path) -> None:
    found = run(tmp_path, "scheduler=serial", "survey.axes.alpha_u=1.0", "solver.cross_check=0.3")
    check = found.summary["cross_check"]
    assert check["rows"] > len(found.optima) + 5
    assert check["disagreements"] == 0


@pytest.mark.slow
def test_the_papers_survey(tmp_path: Path) -> None:
    """√(ST·OS) from IC1 over 121 pairs of orders: 4.966 for PD, at most 3.67 at (0.99, 0.90), measured beforehand."""
    config = compose(["experiment=ic1_inplane", f"output_dir={tmp_path}", "figures=null"])
    result = execute(config)
    assert result.summary["status"] == "finished"
    optima = result.optima[result.optima["objective_name"] == "st_os"]
    slices = optima[optima["kind"] == "slice"].set_index(["alpha_u", "alpha_v"])["objective_st_os"]
    assert len(slices) == 121
    assert slices[1.0, 1.0] == pytest.approx(4.966, abs=5e-4)
    assert slices[0.99, 0.90] <= 3.67
    assert result.summary["optimum"]["objective"] <= 3.0
