"""A run from beginning to end, in this process."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from fracctl.errors import RunError
from fracctl.execution.computation import Job
from fracctl.execution.perform import perform
from fracctl.store import RunDirectory
from fracctl.surveys import Block
from fracctl.surveys.base import Rows
from tests.execution.fakes import N_BLOCKS, N_POINTS, job


class Watch:
    """A progress that remembers, and interrupts after some points."""

    def __init__(self, interrupt_after: int | None = None) -> None:
        self.total: int | None = None
        self.points = 0
        self.stored = 0
        self.finished = False
        self._interrupt_after = interrupt_after

    def start(self, total_points: int | None) -> None:
        self.total = total_points

    def advance(self, points: int) -> None:
        self.points += points
        if self._interrupt_after is not None and self.points >= self._interrupt_after:
            raise KeyboardInterrupt

    def found(self, points: int) -> None:
        self.points += points
        self.stored += points

    def finish(self) -> None:
        self.finished = True


def tables_of(path: Path) -> dict[str, dict[str, Any]]:
    """Everything in the tables, numbers as their bytes."""
    found = {}
    for name in ("evaluations", "optima", "trajectories"):
        table = pq.read_table(path / f"{name}.parquet")
        columns = {c: table.column(c) for c in table.column_names}
        found[name] = {
            c: column.to_numpy().tobytes() if column.type in ("double", "int64") else column.to_pylist()
            for c, column in columns.items()
        }
    return found


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return perform(job(tmp_path_factory.mktemp("undisturbed"))).run_directory


def files_of(path: Path) -> set[str]:
    return {str(found.relative_to(path)) for found in path.rglob("*")}


def test_the_directory_holds_what_the_design_says(undisturbed: Path) -> None:
    tables = {f"{name}.parquet" for name in ("evaluations", "optima", "poles", "frequency_response", "trajectories")}
    assert files_of(undisturbed) == tables | {"run.json", "run.log", "manifest.sha256"}
    assert RunDirectory(undisturbed).verify() == []
    assert undisturbed.parent.name == "fake"
    assert files_of(undisturbed.parent) == {undisturbed.name} | {
        f"{undisturbed.name}/{n}" for n in files_of(undisturbed)
    }


def test_evaluations_hold_every_point_once_in_order(undisturbed: Path) -> None:
    frame = RunDirectory(undisturbed).evaluations()
    assert len(frame) == 2 * N_POINTS
    assert not frame.duplicated(["point", "initial_condition"]).any()
    points = frame.drop_duplicates("point")
    assert points["point"].tolist() == list(range(N_POINTS))
    assert points["alpha_w"].is_monotonic_increasing
    assert list(frame)[:3] == ["point", "initial_condition", "alpha_w"]
    assert frame["reason"].isna().all()


def test_optima_and_trajectories_belong_together(undisturbed: Path) -> None:
    run = RunDirectory(undisturbed)
    optima, trajectories = run.optima(), run.trajectories()
    counts = optima.groupby(["kind", "objective_name", "initial_condition"]).size()
    assert counts.loc["slice"].eq(5).all()
    assert counts.loc["overall"].eq(1).all()
    best = optima.query("kind == 'overall' and objective_name == 'time' and initial_condition == 'one'").iloc[0]
    assert (best["alpha_w"], best["k_p_w"], best["k_d_w"]) == (0.8, 0.8, 1.6)
    shown = optima[optima["kind"].isin(["overall", "baseline"])]
    assert sorted(trajectories["run"].unique()) == shown.index.tolist()
    last = trajectories[trajectories["run"] == best.name].iloc[-1]
    assert last["time"] == 10.0
    assert last["w"] == pytest.approx(np.exp(-10.0 * best["alpha_w"]))
    assert list(trajectories) == ["run", "time", "w", "w_dot", "control_w"]


def test_the_summary_is_plain_and_stored(undisturbed: Path) -> None:
    summary = RunDirectory(undisturbed).run_json["summary"]
    assert summary["status"] == "finished"
    assert summary["experiment"] == "fake"
    assert summary["run_directory"] == str(undisturbed)
    assert summary["optimum"]["settling_time"] == pytest.approx(0.8)
    assert summary["baseline"]["alpha_w"] == 1.0
    assert summary["change_percent"] == pytest.approx(-20.0)
    assert summary["error"] is None
    assert [(r["objective_name"], r["initial_condition"]) for r in summary["optima"]] == [
        ("time", "one"),
        ("time", "two"),
        ("joint", "one"),
        ("joint", "two"),
    ]
    json.dumps(summary, allow_nan=False)


def test_run_json_and_footers_say_where_the_numbers_come_from(undisturbed: Path) -> None:
    content = RunDirectory(undisturbed).run_json
    provenance = content["provenance"]
    assert provenance["versions"]["numpy"] == np.__version__
    assert provenance["seed"] == 0
    assert provenance["workers"] == 1
    assert provenance["wall_time_s"] > 0.0
    for name in ("evaluations", "optima", "trajectories"):
        metadata = pq.read_schema(undisturbed / f"{name}.parquet").metadata
        assert json.loads(metadata[b"fracctl.configuration"]) == content["configuration"]
        assert json.loads(metadata[b"fracctl.provenance"])["platform"] == provenance["platform"]


def test_an_identical_run_computes_nothing(tmp_path: Path) -> None:
    watch = Watch()
    first = perform(job(tmp_path))
    again = perform(job(tmp_path, faults=[{"kind": "raises", "alpha_w": 0.8}]), progress=watch)
    assert not first.reused
    assert again.reused
    assert watch.total is None
    assert again.summary == first.summary | {"reused": True}
    pd.testing.assert_frame_equal(again.evaluations, first.evaluations)
    pd.testing.assert_frame_equal(again.optima, first.optima)


def test_another_run_gets_another_directory(tmp_path: Path) -> None:
    assert perform(job(tmp_path)).run_directory != perform(job(tmp_path, seed=1)).run_directory


def test_fresh_computes_again_in_the_same_place(tmp_path: Path, undisturbed: Path) -> None:
    first = perform(job(tmp_path))
    marker = first.run_directory / "report.html"
    marker.touch()
    again = perform(job(tmp_path), fresh=True)
    assert not again.reused
    assert again.run_directory == first.run_directory
    assert not marker.exists()
    assert list(again.run_directory.parent.iterdir()) == [again.run_directory]
    assert tables_of(again.run_directory) == tables_of(undisturbed)


def test_fresh_keeps_the_stored_run_until_it_is_done(tmp_path: Path, undisturbed: Path) -> None:
    first = perform(job(tmp_path)).run_directory
    with pytest.raises(KeyboardInterrupt):
        perform(job(tmp_path), fresh=True, progress=Watch(interrupt_after=1))
    aside = first.with_name(f".{first.name}.old")
    assert tables_of(aside) == tables_of(undisturbed)
    again = perform(job(tmp_path))
    assert not again.reused
    assert list(first.parent.iterdir()) == [first]
    assert tables_of(first) == tables_of(undisturbed)


def test_a_damaged_run_is_computed_again_with_a_note(tmp_path: Path, undisturbed: Path) -> None:
    first = perform(job(tmp_path))
    path = first.run_directory / "evaluations.parquet"
    content = bytearray(path.read_bytes())
    content[1000] ^= 1
    path.write_bytes(bytes(content))
    again = perform(job(tmp_path))
    assert not again.reused
    assert again.summary["notes"] == [
        "the stored run was damaged (evaluations.parquet has changed) and has been computed again"
    ]
    assert tables_of(again.run_directory) == tables_of(undisturbed)
    assert RunDirectory(again.run_directory).verify() == []


def test_fresh_keeps_a_finished_run_that_a_worse_one_would_replace(tmp_path: Path, undisturbed: Path) -> None:
    first = perform(job(tmp_path)).run_directory
    aside = first.with_name(f".{first.name}.old")
    kept = f"the run that was stored here before is kept in {aside}"
    for alphas in ((0.8,), (0.8, 0.85)):
        faults = [{"kind": "raises", "alpha_w": alpha} for alpha in alphas]
        worse = perform(job(tmp_path, faults=faults), fresh=True)
        assert worse.status == "incomplete"
        assert kept in worse.summary["notes"]
        assert tables_of(aside) == tables_of(undisturbed)
    faults = [{"kind": "raises", "alpha_w": alpha} for alpha in (0.8, 0.85, 0.9, 0.95, 1.0)]
    with pytest.raises(RunError, match=r"every point failed: .*; the run that was stored here before is kept in "):
        perform(job(tmp_path, faults=faults), fresh=True)
    assert RunDirectory(aside).verify() == []
    better = perform(job(tmp_path))
    assert better.status == "finished"
    assert kept not in better.summary["notes"]
    assert not aside.exists()


@pytest.mark.parametrize("name", ["optima.parquet", "run.json"])
@pytest.mark.parametrize("survey", [None, "searches"])
def test_what_is_made_of_whole_points_is_made_again_alone(tmp_path: Path, name: str, survey: str | None) -> None:
    one = search(tmp_path, Searches) if survey else job(tmp_path)
    first = perform(one).run_directory
    before = tables_of(first)
    (first / name).write_bytes(b"{")
    (first / "figures").mkdir()
    watch = Watch()
    again = perform(one, progress=watch)
    assert not again.reused
    assert watch.stored == watch.points > 0
    said = f"the stored run was damaged ({name} has changed); all but its evaluated points has been made again"
    assert again.summary["notes"][0] == said
    assert tables_of(first) == before
    assert RunDirectory(first).verify() == []
    assert not (first / "parts").exists()
    assert not (first / "figures").exists()


def test_points_are_not_trusted_without_their_digest(tmp_path: Path) -> None:
    first = perform(job(tmp_path)).run_directory
    (first / "manifest.sha256").write_bytes(b"\xff")
    watch = Watch()
    assert not perform(job(tmp_path), progress=watch).reused
    assert watch.stored == 0


def test_a_line_in_the_log_changes_nothing(tmp_path: Path) -> None:
    first = perform(job(tmp_path)).run_directory
    with (first / "run.log").open("a") as log:
        log.write("looked at\n")
    assert perform(job(tmp_path)).reused


@pytest.mark.parametrize("name", ["run.log", "optima.parquet", "run.json"])
def test_parts_of_an_incomplete_run_outlive_other_files(tmp_path: Path, undisturbed: Path, name: str) -> None:
    first = perform(job(tmp_path, faults=[{"kind": "raises", "alpha_w": 0.8}])).run_directory
    with (first / name).open("a") as file:
        file.write("touched\n")
    watch = Watch()
    again = perform(job(tmp_path), progress=watch)
    assert watch.stored == (N_BLOCKS - 1) * N_POINTS // N_BLOCKS
    assert again.status == "finished"
    assert tables_of(first) == tables_of(undisturbed)


@pytest.mark.parametrize("after", [1, N_POINTS // 2, N_POINTS])
def test_an_interrupted_run_continues(tmp_path: Path, undisturbed: Path, after: int) -> None:
    watch = Watch(interrupt_after=after)
    with pytest.raises(KeyboardInterrupt):
        perform(job(tmp_path), progress=watch)
    assert watch.finished
    (directory,) = (tmp_path / "fake").iterdir()
    assert RunDirectory(directory).status == "interrupted"
    kept = len(list((directory / "parts").glob("*.parquet")))
    assert 0 < kept <= N_BLOCKS
    watch = Watch()
    finished = perform(job(tmp_path), progress=watch)
    assert (watch.points, watch.stored) == (N_POINTS, kept * N_POINTS // N_BLOCKS)
    assert f"{N_BLOCKS} blocks: {kept} were stored" in (directory / "run.log").read_text()
    assert tables_of(finished.run_directory) == tables_of(undisturbed)


def test_progress_counts_every_row(tmp_path: Path) -> None:
    watch = Watch()
    perform(job(tmp_path), progress=watch)
    assert (watch.total, watch.points, watch.finished) == (N_POINTS, N_POINTS, True)


@pytest.mark.parametrize("kind", ["raises", "exits", "returns nonsense"])
def test_a_failed_block_is_rows_with_a_reason_and_tried_again(tmp_path: Path, undisturbed: Path, kind: str) -> None:
    first = perform(job(tmp_path, faults=[{"kind": kind, "alpha_w": 0.8}]))
    failed = first.evaluations[first.evaluations["status"] == "failed"]
    reasons = {
        "raises": "ValueError: the fault was asked for",
        "exits": "SystemExit: 3",
        "returns nonsense": "ValueError: the evaluation must return 882 values of nodes",
    }
    assert len(failed) == 2 * 441
    assert failed["reason"].unique().tolist() == [reasons[kind]]
    assert failed["k_p_w"].notna().all()
    assert failed["stable"].isna().all()
    assert first.optima["alpha_w"].min() == 0.85
    assert first.summary["status"] == "incomplete"
    assert (
        first.summary["error"]
        == f"441 points could not be computed ({reasons[kind]}); the same command tries them again"
    )
    assert "882 of 4410 rows failed and are in no result" in first.summary["notes"]
    again = perform(job(tmp_path))
    assert again.summary["status"] == "finished"
    assert tables_of(again.run_directory) == tables_of(undisturbed)
    assert not (again.run_directory / "parts").exists()


def test_a_run_without_one_good_point_is_an_error(tmp_path: Path) -> None:
    faults = [{"kind": "raises", "alpha_w": alpha} for alpha in (0.8, 0.85, 0.9, 0.95, 1.0)]
    with pytest.raises(RunError, match=r"every point failed: ValueError: the fault was asked for$"):
        perform(job(tmp_path, faults=faults))
    (directory,) = (tmp_path / "fake").iterdir()
    assert RunDirectory(directory).run_json["error"] == "every point failed: ValueError: the fault was asked for"
    assert perform(job(tmp_path)).summary["status"] == "finished"


def test_the_stored_configuration_is_the_given_one(tmp_path: Path) -> None:
    one = job(tmp_path)
    assert RunDirectory(perform(one).run_directory).run_json["configuration"] == one.configuration


class Descent:
    """A search: each of four blocks is a row of gains about the best point of the block before."""

    n_points = None
    columns = slices = ()
    baseline: Mapping[str, float] = {}

    def __init__(self) -> None:
        self._centre, self._asked, self._told = 0.0, 0, 0

    @property
    def finished(self) -> bool:
        return self._told == 4

    def ask(self) -> list[Block]:
        if self._asked > self._told or self.finished:
            return []
        k_p = self._centre + np.linspace(-0.3, 0.3, 7)
        self._asked += 1
        design = {"alpha_w": np.full(7, 0.9), "k_p_w": k_p, "k_d_w": np.full(7, 1.8)}
        return [Block(self._told, 7 * self._told, design)]

    def tell(self, number: int, rows: Rows) -> None:
        assert number == self._told
        self._centre = float(rows["k_p_w"][np.argmin(rows["settling_time"])])
        self._told += 1


def search(folder: Path, survey: Callable[[], Any] = Descent) -> Job:
    return replace(job(folder), survey=survey)


def test_a_search_continues_by_replay(tmp_path: Path) -> None:
    whole = perform(search(tmp_path / "whole"))
    assert whole.optima["k_p_w"].iloc[0] == pytest.approx(0.9)
    with pytest.raises(KeyboardInterrupt):
        perform(search(tmp_path / "parts"), progress=Watch(interrupt_after=10))
    continued = perform(search(tmp_path / "parts"))
    assert "4 blocks: 2 were stored" in (continued.run_directory / "run.log").read_text()
    assert tables_of(continued.run_directory) == tables_of(whole.run_directory)


@dataclass(frozen=True)
class Steps:
    """A search: one step of each start towards the bottom of the bowl, for one initial condition."""

    searched_for: str

    def __call__(self, evaluation: Any, starts: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        first = evaluation.initial_conditions
        evaluation.initial_conditions = {"one": first["one"]}
        parts = [evaluation(starts), evaluation(dict(starts) | {"k_p_w": starts["alpha_w"]})]
        evaluation.initial_conditions = first
        rows = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        size = len(starts["alpha_w"])
        rows["searched_for"] = np.full(2 * size, self.searched_for, dtype=object)
        rows["evaluations_spent"] = np.repeat([1, 2], size)
        return rows | {"point": np.tile(np.arange(size), 2)}


class Searches(Descent):
    """Two blocks of two searches each, the second for another objective."""

    n_points = 4
    columns = ("searched_for", "evaluations_spent")

    @property
    def finished(self) -> bool:
        return self._told == 2

    def ask(self) -> list[Block]:
        if self._asked:
            return []
        self._asked = 2
        design = {"alpha_w": np.full(2, 0.9), "k_p_w": np.array([0.5, 2.0]), "k_d_w": np.full(2, 1.8)}
        return [Block(i, 2 * i, design, Steps(name)) for i, name in enumerate(("time", "joint"))]

    def tell(self, number: int, rows: Rows) -> None:
        self._told += 1


def test_the_rows_of_searches_are_their_paths(tmp_path: Path) -> None:
    result = perform(search(tmp_path, Searches))
    rows = result.evaluations
    assert rows["point"].tolist() == [0, 1, 0, 1, 2, 3, 2, 3]
    assert rows["evaluations_spent"].tolist() == [1, 1, 2, 2] * 2
    assert rows["searched_for"].tolist() == ["time"] * 4 + ["joint"] * 4
    assert set(rows["initial_condition"]) == {"one"}
    found = result.optima.set_index("objective_name")
    assert found.loc["time", "searched_for"] == "time"
    assert found.loc["joint", "searched_for"] == "joint"
    again = perform(search(tmp_path, Searches))
    assert again.reused


def test_rows_of_other_points_answer_no_question(tmp_path: Path) -> None:
    class Elsewhere(Descent):
        def __init__(self) -> None:
            super().__init__()
            self._centre = 0.05

    with pytest.raises(KeyboardInterrupt):
        perform(search(tmp_path), progress=Watch(interrupt_after=10))
    other = perform(search(tmp_path, Elsewhere))
    assert "4 blocks: 0 were stored" in (other.run_directory / "run.log").read_text()
    assert len(other.evaluations) == 2 * 28


def test_a_survey_that_asks_for_nothing_more_is_an_error(tmp_path: Path) -> None:
    class Stuck(Descent):
        def ask(self) -> list[Block]:
            return [] if self._asked else super().ask()

    with pytest.raises(RunError, match="the survey is not finished, but has no further points"):
        perform(search(tmp_path, Stuck))
