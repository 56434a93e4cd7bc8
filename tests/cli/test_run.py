"""`fracctl run`: what it prints, in which order things happen, and what failures do. The computation is a stand-in."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from fracctl.cli.main import main
from fracctl.config.compose import compose
from fracctl.config.schemas import RunConfig
from fracctl.errors import RunError
from fracctl.store.identity import run_id

POINT = {"initial_condition": "ic1", "alpha_w": 0.91, "k_p_w": 0.85, "k_d_w": 2.0, "settling_time": 3.01276,
         "overshoot": 7.7874, "control_effort": 2.638e-3, "objective": 3.01276, "objective_settling_time": 3.01276,
         "objective_st_os_u": 0.395, "status": "ok", "stable": True, "error_estimate": 1e-9, "nodes": 40}  # fmt: skip
BASELINE = POINT | {"alpha_w": 1.0, "k_p_w": 0.55, "settling_time": 3.96958}


@dataclass
class Result:
    summary: dict[str, Any]


@dataclass
class StandIn:
    """Stands in for `execute`: notes what it is called with, and answers or fails as it is told."""

    calls: list[RunConfig] = field(default_factory=list)
    options: list[dict[str, Any]] = field(default_factory=list)
    fails: Callable[[RunConfig], Exception | None] = lambda config: None
    further: dict[str, Any] = field(default_factory=dict)

    def __call__(self, config: RunConfig, **options: Any) -> Result:
        self.calls.append(config)
        self.options.append(options)
        if error := self.fails(config):
            raise error
        return Result(summary(config.name) | self.further)


def summary(name: str) -> dict[str, Any]:
    return {
        "experiment": name, "run_id": "0123456789ab", "run_directory": f"/runs/{name}/0123456789ab",
        "status": "finished", "reused": False, "optimum": POINT, "baseline": BASELINE, "change_percent": -24.1,
        "error": None,
    }  # fmt: skip


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> StandIn:
    found = StandIn()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("fracctl.execution.run.execute", found)
    return found


@pytest.mark.usefixtures("stand_in")
def test_a_table_and_the_directory_as_the_last_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "experiment=ic1_outofplane"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    lines = captured.out.splitlines()
    assert lines[-1] == "/runs/ic1_outofplane/0123456789ab"
    assert lines[0] == "ic1_outofplane"
    assert lines[2].split() == ["alpha_w", "k_p_w", "k_d_w", "settling_time", "overshoot", "control_effort"]
    assert lines[3].split() == ["ic1", "optimum", "0.91", "0.85", "2", "3.01276", "0.4795", "T", "7.7874", "0.002638"]
    assert "0.6318 T" in lines[4]
    assert lines[5].split() == ["change", "-24.1", "%"]
    columns = [line.index("7.7874") for line in lines[3:5]]
    assert columns == [lines[2].index("overshoot")] * 2


def test_several_objectives_and_initial_conditions(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.further["optima"] = [
        {"initial_condition": ic, "objective_name": name, "optimum": optimum, "baseline": None, "change_percent": None}
        for name in ("settling_time", "st_os_u")
        for ic, optimum in (("ic1", POINT), ("ic2", None))
    ]
    assert main(["run"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == "settling_time"
    assert lines[4].split() == ["ic2", "no", "result"]
    assert lines[5] == "st_os_u = (settling_time · overshoot · control_effort)^(1/3)"
    assert lines[7].split()[-1] == "0.395"


def test_a_baseline_that_ended_early_is_shown_with_its_status(
    capsys: pytest.CaptureFixture[str], stand_in: StandIn
) -> None:
    ended, stayed = POINT | {"status": "escaped"}, POINT | {"status": "ok"}
    common = {"objective_name": "settling_time", "change_percent": None}
    stand_in.further["optima"] = [
        common | {"initial_condition": "ic1", "optimum": None, "baseline": ended},
        common | {"initial_condition": "ic2", "optimum": stayed, "baseline": stayed, "change_percent": 0.0},
    ]
    assert main(["run", "experiment=ic1_outofplane"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines[2][-1] == "status"
    assert lines[3][:4] == ["ic1", "baseline", "(no", "optimum)"]
    assert lines[3][-1] == "escaped"
    assert lines[4][:4] == ["ic2", "optimum", "=", "baseline"]
    assert lines[4][-1] == "ok"


def test_many_gains_stand_below_each_other(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    names = ("alpha_u", "alpha_v", "k_p_u", "k_p_uv", "k_p_vu", "k_p_v", "k_d_u", "k_d_uv", "k_d_vu", "k_d_v")
    measured = {
        "settling_time": 3.7,
        "overshoot": 6.6,
        "control_effort": 2e-3,
        "objective": 4.9,
        "objective_st_os": 4.9,
    }
    point = {"initial_condition": "ic1"} | {name: float(i) for i, name in enumerate(names)} | measured
    stand_in.further["optima"] = [
        {"initial_condition": "ic1", "objective_name": "st_os", "optimum": None, "baseline": None}
        | {"change_percent": None},
        {"initial_condition": "ic2", "objective_name": "st_os", "optimum": point, "baseline": point | {"k_d_v": 9.5}}
        | {"change_percent": -1.25},
    ]
    assert main(["run", "experiment=ic1_inplane"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()[1:-1]]
    assert lines[:3] == [
        ["st_os", "=", "(settling_time", "·", "overshoot)^(1/2)"],
        ["ic1", "ic2"],
        ["no", "optimum", "optimum", "baseline"],
    ]
    assert [line[0] for line in lines[3:13]] == list(names)
    assert lines[12:15] == [
        ["k_d_v", "9", "9.5"], ["settling_time", "3.7", "3.7"], ["0.5889", "T", "0.5889", "T"]
    ]  # fmt: skip
    assert lines[-2:] == [["st_os", "4.9", "4.9"], ["change", "-1.2", "%"]]


def test_many_gains_that_do_not_vary_are_not_shown(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", "plant=hcw", "controller=pd_alpha_full"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].split() == ["settling_time", "overshoot", "control_effort"]


def test_notes_follow_the_table(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.further["notes"] = ["U depends on the horizon"]
    assert main(["run"]) == 0
    assert capsys.readouterr().out.splitlines()[-2] == "note: U depends on the horizon"
    assert main(["run", "--quiet"]) == 0
    assert "note" not in capsys.readouterr().out


def test_a_stored_run_is_called_so(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.further["reused"] = True
    assert main(["run", "--fresh"]) == 0
    assert capsys.readouterr().out.startswith("custom, stored already\n")
    assert stand_in.options[0]["fresh"] is True


def test_json_is_a_line_a_run_and_nothing_else(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.further["baseline"] = BASELINE | {"settling_time": math.inf, "overshoot": math.nan}
    assert main(["run", "-m", "experiment=ic1_outofplane,ic2_outofplane,ic3_outofplane", "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    runs = [json.loads(line) for line in captured.out.splitlines()]
    assert [run["experiment"] for run in runs] == [f"ic{i}_outofplane" for i in (1, 2, 3)]
    keys = [
        "experiment",
        "run_id",
        "run_directory",
        "status",
        "reused",
        "optimum",
        "baseline",
        "change_percent",
        "error",
        "multirun_summary",
    ]
    assert list(runs[0]) == keys
    assert all(Path(run["multirun_summary"]).is_file() for run in runs)
    assert runs[0]["baseline"]["settling_time"] is None
    assert runs[0]["baseline"]["overshoot"] is None


def test_all_runs_are_composed_before_the_first_starts(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", "-m", "controller.alpha_w=0.9,1.2,1.3"]) == 3
    captured = capsys.readouterr()
    assert stand_in.calls == []
    assert captured.out == ""
    assert captured.err.splitlines() == [
        "error: run 2 of 3 (controller.alpha_w=1.2): controller.alpha_w = 1.2: must lie in (0, 1]",
        "error: run 3 of 3 (controller.alpha_w=1.3): controller.alpha_w = 1.3: must lie in (0, 1]",
    ]


@pytest.mark.parametrize(
    ("words", "cure"),
    [
        (["-m", "controller.alpha_w=0.9,0.95", "controller.alpha_w=1"], "; for a run with each, write -m "),
        (["-m", "controller.alpha_w=1", "+controller.alpha_w=0.9,0.95"], "; for a run with each, write -m "),
        (["controller.alpha_w=1", "controller.alpha_w=1"], "; for a run with each, write -m controller.alpha_w=1,1"),
        (["~controller.alpha_w", "controller.alpha_w=1"], ""),
    ],
)
def test_a_key_is_set_once(words: list[str], cure: str, capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", *words]) == 3
    assert stand_in.calls == []
    said = capsys.readouterr().err.rstrip()
    first, second = words[-2:]
    assert said.startswith(f"error: controller.alpha_w is set twice, '{first}' and '{second}'; keep one of them{cure}")
    assert cure or said.endswith("keep one of them")


def test_a_group_is_chosen_once(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", "-m", "controller=pd", "controller=pd_alpha,pid"]) == 3
    assert capsys.readouterr().err.startswith("error: run 1 of 2 (controller=pd_alpha): controller is chosen twice, ")
    assert stand_in.calls == []


def test_an_error_of_all_runs_is_told_once(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", "-m", "controller.alpha_w=0.9,0.95", "controller.foo=1"]) == 3
    assert capsys.readouterr().err == "error: unknown key 'controller.foo'; allowed: type, alpha_w, k_p_w, k_d_w\n"


def fails_at(order: float) -> Callable[[RunConfig], Exception | None]:
    return lambda config: RunError("the disk is full") if config.controller.model_dump()["alpha_w"] == order else None


def test_other_runs_go_on_after_a_failure(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.fails = fails_at(0.9)
    assert main(["run", "-m", "controller.alpha_w=0.8,0.9,1.0"]) == 1
    captured = capsys.readouterr()
    assert len(stand_in.calls) == 3
    assert captured.out.count("\n/runs/custom") == 2
    assert captured.err == "error: run 2 of 3 (controller.alpha_w=0.9): the disk is full\n"


def test_fail_fast_stops(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.fails = fails_at(0.8)
    assert main(["run", "-m", "controller.alpha_w=0.8,0.9,1.0", "--fail-fast"]) == 1
    assert len(stand_in.calls) == 1


def test_a_failed_run_has_its_line_of_json(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.fails = fails_at(0.9)
    assert main(["run", "controller.alpha_w=0.9", "--json"]) == 1
    captured = capsys.readouterr()
    (line,) = captured.out.splitlines()
    expected = run_id(compose(["controller.alpha_w=0.9"]).model_dump(mode="json"))
    assert json.loads(line) == dict.fromkeys(summary("")) | {
        "experiment": "custom", "run_id": expected, "status": "failed", "reused": False, "error": "the disk is full"
    }  # fmt: skip
    assert captured.err == "error: the disk is full\n"
    folder = Path("outputs/custom") / expected
    folder.mkdir(parents=True)
    assert main(["run", "controller.alpha_w=0.9", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["run_directory"] == str(folder.absolute())


def test_fail_fast_goes_with_several_runs(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", "--fail-fast"]) == 2
    assert capsys.readouterr().err.startswith("error: --fail-fast goes with -m")
    assert stand_in.calls == []


def test_configurations_as_json(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", "-m", "seed=1,2", "--cfg=job", "--json"]) == 0
    found = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert found == [compose([f"seed={seed}"]).model_dump(mode="json") for seed in (1, 2)]


def test_an_incomplete_run_shows_what_it_has_and_fails(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    stand_in.further = {"status": "incomplete", "error": "3 points could not be computed", "failed_points": 3}
    assert main(["run", "--quiet"]) == 1
    captured = capsys.readouterr()
    assert captured.out.splitlines()[0] == "custom, incomplete: 3 points missing"
    assert captured.out.splitlines()[-1] == "/runs/custom/0123456789ab"
    assert captured.err == "error: 3 points could not be computed\n"


def test_an_interruption_ends_the_sweep(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    def interrupt(config: RunConfig) -> None:
        raise KeyboardInterrupt

    stand_in.fails = interrupt
    assert main(["run", "-m", "controller.alpha_w=0.8,0.9"]) == 130
    assert len(stand_in.calls) == 1


def test_cfg_job_prints_the_configuration_only(capsys: pytest.CaptureFixture[str], stand_in: StandIn) -> None:
    assert main(["run", "experiment=outofplane", "--cfg", "job"]) == 0
    out = capsys.readouterr().out
    assert "name: outofplane\n" in out
    assert "    alpha_w: 0.80:1.00:0.01\n" in out or "    alpha_w: '0.80:1.00:0.01'\n" in out
    assert stand_in.calls == []


def test_a_printed_configuration_is_an_experiment(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, stand_in: StandIn
) -> None:
    assert main(["run", "experiment=outofplane", "--cfg=job"]) == 0
    printed = capsys.readouterr().out
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "copy.yaml").write_text(printed)
    words = ["plant=hcw_out_of_plane", "initial_condition=[]", "measures=standard", "figures=null"]
    assert main(["run", "experiment=copy", "--config-dir", str(tmp_path), "--cfg=job", *words]) == 0
    assert capsys.readouterr().out == printed


def test_sweeping_configurations_are_printed_one_after_the_other(
    capsys: pytest.CaptureFixture[str], stand_in: StandIn
) -> None:
    assert main(["run", "-m", "seed=1,2", "--cfg=job"]) == 0
    first, second = capsys.readouterr().out.split("---\n")
    assert first.replace("seed: 1", "seed: 2") == second
