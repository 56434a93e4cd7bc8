"""The summary of `fracctl run -m`: one table over all runs, on the terminal and in a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from fracctl.cli.main import main
from fracctl.config.schemas import RunConfig
from tests.cli.test_run import Result, fails_at
from tests.store.disks import full_after

VALUES = {0.8: 5.0, 0.9: 3.0, 1.0: 4.0}


class Ran:
    """Stands in for `execute`: settles after what `VALUES` says for each order, or fails as it is told."""

    def __init__(self, fails: Any = lambda config: None) -> None:
        self.calls: list[RunConfig] = []
        self.fails = fails
        self.further: dict[str, Any] = {}

    def __call__(self, config: RunConfig, **options: Any) -> Result:
        self.calls.append(config)
        if error := self.fails(config):
            raise error
        order = config.controller.model_dump()["alpha_w"]
        optima = [self._result(config, order, name) for name in config.objectives]
        return Result(
            {
                "experiment": config.name,
                "run_directory": f"{Path.cwd()}/outputs/custom/{order:g}",
                "status": "finished",
                "reused": False,
                "optima": optima,
                "optimum": optima[0]["optimum"],
                "baseline": None,
                "change_percent": None,
                "error": None,
            }
            | self.further
        )

    def _result(self, config: RunConfig, order: float, name: str) -> Mapping[str, Any]:
        value = VALUES[order]
        point = {
            "initial_condition": "ic1",
            "settling_time": value,
            "objective": value,
            "objective_settling_time": value,
        }
        optimum = None if np.isinf(value) else point | {"objective_st_os_u": value / 10.0, "status": "ok"}
        return {"initial_condition": "ic1", "objective_name": name, "optimum": optimum, "baseline": None} | {
            "change_percent": None
        }


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Ran:
    found = Ran()
    monkeypatch.setattr("fracctl.execution.run.execute", found)
    monkeypatch.chdir(tmp_path)
    return found


SWEEP = ["run", "-m", "controller.alpha_w=0.8,0.9,1.0"]


def summary(folder: Path) -> pd.DataFrame:
    (path,) = folder.glob("outputs/multirun/*/summary.parquet")
    return pd.read_parquet(path)


def test_the_best_run_stands_first(ran: Ran, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(SWEEP) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    lines = captured.out.splitlines()
    start = lines.index("summary of 3 runs, best first")
    assert [line.split() for line in lines[start + 1 : -1]] == [
        ["settling_time"],
        ["controller.alpha_w", "settling_time", "st_os_u", "status", "directory"],
        ["0.9", "3", "0.4775", "T", "0.3", "finished", "outputs/custom/0.9"],
        ["1", "4", "0.6366", "T", "0.4", "finished", "outputs/custom/1"],
        ["0.8", "5", "0.7958", "T", "0.5", "finished", "outputs/custom/0.8"],
    ]
    assert Path(lines[-1]).is_file()
    found = summary(tmp_path)
    assert found["controller.alpha_w"].tolist() == [0.9, 1.0, 0.8]
    assert found["objective"].tolist() == [3.0, 4.0, 5.0]
    assert found["objective_st_os_u"].tolist() == [0.3, 0.4, 0.5]
    assert set(found["factors"]) == {"settling_time"}
    assert set(found["unit"]) == {"1"}
    assert (found["length_scale_m"] > 6e6).all()
    assert found["run_id"].nunique() == 3


def test_the_same_sweep_has_the_same_id_in_any_order(ran: Ran, tmp_path: Path) -> None:
    main(SWEEP)
    main(["run", "-m", "controller.alpha_w=1.0,0.8,0.9"])
    assert len(list(tmp_path.glob("outputs/multirun/*"))) == 1
    main(["run", "-m", "controller.alpha_w=1.0,0.8"])
    assert len(list(tmp_path.glob("outputs/multirun/*"))) == 2


def test_json_stays_a_line_a_run(ran: Ran, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ran.fails = fails_at(0.9)
    assert main([*SWEEP, "--json"]) == 1
    captured = capsys.readouterr()
    runs = [json.loads(line) for line in captured.out.splitlines()]
    assert [run["status"] for run in runs] == ["finished", "failed", "finished"]
    (path,) = {run["multirun_summary"] for run in runs}
    assert pd.read_parquet(path)["status"].tolist() == ["finished", "finished", "failed"]
    assert captured.err == "error: run 2 of 3 (controller.alpha_w=0.9): the disk is full\n"


def test_failures_stand_last_and_the_others_are_kept(
    ran: Ran, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ran.fails = fails_at(0.9)
    assert main(SWEEP) == 1
    captured = capsys.readouterr()
    assert captured.out.splitlines()[-2].split() == ["0.9", "-", "-", "failed", "-"]
    assert captured.err == "error: run 2 of 3 (controller.alpha_w=0.9): the disk is full\n"
    found = summary(tmp_path)
    assert found["status"].tolist() == ["finished", "finished", "failed"]
    assert found["error"].fillna("").tolist() == ["", "", "the disk is full"]
    assert found["objective"].isna().tolist() == [False, False, True]


def test_runs_that_a_failure_kept_from_starting_are_named(ran: Ran, tmp_path: Path) -> None:
    ran.fails = fails_at(0.9)
    assert main([*SWEEP, "--fail-fast"]) == 1
    assert len(ran.calls) == 2
    assert summary(tmp_path)["status"].tolist() == ["finished", "failed", "not started"]


def test_an_incomplete_run_is_called_so(ran: Ran, tmp_path: Path) -> None:
    ran.further = {"status": "incomplete", "error": "9 points could not be computed", "failed_points": 9}
    assert main(SWEEP) == 1
    assert set(summary(tmp_path)["status"]) == {"incomplete"}


def test_an_interruption_leaves_the_summary(ran: Ran, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupt(config: RunConfig) -> None:
        if len(ran.calls) == 2:
            raise KeyboardInterrupt

    ran.fails = interrupt
    assert main(SWEEP) == 130
    assert "summary of the runs so far: " in capsys.readouterr().err
    assert summary(tmp_path)["status"].tolist() == ["finished", "interrupted", "not started"]


def test_objectives_that_differ_are_not_ranked_with_each_other(
    ran: Ran, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*SWEEP, "objective=settling_time,st_os_u"]) == 0
    out = capsys.readouterr().out
    assert "note: runs with different objectives are not ranked with each other\n" in out
    assert "\nst_os_u = (settling_time · overshoot · control_effort)^(1/3)\n" in out
    found = summary(tmp_path)
    assert found["objective_name"].tolist() == ["settling_time"] * 3 + ["st_os_u"] * 3
    assert found["objective"].tolist() == [3.0, 4.0, 5.0, 0.3, 0.4, 0.5]


def test_runs_of_different_scales_say_so(ran: Ran, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["run", "-m", "plant.chief.semi_major_axis_km=8000,10000"]
    assert main(words) == 0
    assert "note: 1 stands for other lengths and times in some of these runs" in capsys.readouterr().out
    assert summary(tmp_path)["time_scale_s"].nunique() == 2


def test_a_summary_that_cannot_be_written_is_a_failure(
    ran: Ran, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with full_after(100):
        assert main(SWEEP) == 1
    captured = capsys.readouterr()
    assert captured.out.count("\ncustom\n") == 2
    assert captured.err.startswith("error: summary: cannot write ")


def test_a_sweep_of_real_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["survey=out_of_plane", "survey.axes.k_p_w=[0.55,0.85]", "survey.axes.k_d_w=[2.0]", "figures=[]"]
    sweep = ["run", "-m", *words, "survey.axes.alpha_w=[0.91],[1.0]", "initial_condition=ic1,ic2"]
    assert main(sweep) == 0
    lines = capsys.readouterr().out.splitlines()
    found = summary(tmp_path)
    assert found["objective"].is_monotonic_increasing
    assert found["objective"].iloc[0] == pytest.approx(found["objective_settling_time"].iloc[0])
    assert set(found["initial_condition"]) == {"ic1", "ic2"}
    assert set(found["survey.axes.alpha_w"]) == {"[0.91]", "[1.0]"}
    for directory in found["run_directory"]:
        assert Path(directory).is_dir()
        assert directory in lines
