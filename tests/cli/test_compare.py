"""`fracctl compare`: laws, optima and stored runs in one table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import fracctl as fc
from fracctl.cli.main import main
from fracctl.cli.run_word import names_run
from fracctl.execution.perform import perform
from tests.execution.fakes import job

FEW = ["figures=null", "survey=out_of_plane", "survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=[0.55,0.85]",
       "survey.axes.k_d_w=2"]  # fmt: skip


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def printed(capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    assert main(["compare", *words]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out.splitlines()


def records(capsys: pytest.CaptureFixture[str], *words: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in printed(capsys, *words, "--json")]


def test_laws_stand_beside_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(capsys, "controller=pd,pid", "figures=null")
    assert lines[0].split() == ["ic1", "controller=pd", "controller=pid"]
    rows = {line.split()[0]: line.split()[1:] for line in lines[1:]}
    loop = fc.ClosedLoop(fc.plants.HCWOutOfPlane(), fc.controllers.PD(0.55, 2.0))
    trajectory = fc.solve(loop, [0.0, 0.002], 12.0 * 3.141592653589793)
    settled = float(fc.measures.settling_time(trajectory, threshold=1e-5))
    assert rows["settling_time"][:4] == [f"{settled:.5g}", "=", f"{settled / 6.283185307179586:.4f}", "T"]
    assert rows["k_i_w"] == ["0.1"]  # PD has none
    assert "status" not in rows


def test_optimum_and_baseline_of_one_run(capsys: pytest.CaptureFixture[str]) -> None:
    found = records(capsys, *FEW)
    assert [(record["law"], record["alpha_w"], record["k_p_w"]) for record in found] == [
        ("optimum", 0.91, 0.85),
        ("baseline", 1.0, 0.55),
    ]


def test_stored_runs_are_not_computed_again(capsys: pytest.CaptureFixture[str]) -> None:
    directories = [_run(capsys, f"controller={law}", "figures=null") for law in ("pd", "pd_alpha")]
    found = records(capsys, *map(str, directories))
    assert [record["law"] for record in found] == [f"custom/{path.name}" for path in directories]
    assert [Path(record["run_directory"]) for record in found] == directories
    assert {path.absolute() for path in Path("outputs/custom").iterdir() if path.is_dir()} == set(directories)


def test_a_run_that_lacks_points_is_marked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = perform(job(tmp_path)).run_directory
    lacks = perform(job(tmp_path, seed=1, faults=[{"kind": "raises", "alpha_w": 0.8}])).run_directory
    words = ["compare", str(whole), str(lacks)]
    said = f"error: fake/{lacks.name}: 441 points could not be computed (ValueError: the fault was asked for); "
    assert main(words) == 1
    captured = capsys.readouterr()
    assert f"fake/{lacks.name}, incomplete: 441 points missing" in captured.out
    assert f"fake/{whole.name}, " not in captured.out
    assert captured.err.startswith(said)
    assert main([*words, "--json"]) == 1
    captured = capsys.readouterr()
    found = [json.loads(line) for line in captured.out.splitlines()]
    assert {(Path(record["run_directory"]), record["run_status"]) for record in found} == {
        (whole, "finished"),
        (lacks, "incomplete"),
    }
    assert captured.err.startswith(said)


def _run(capsys: pytest.CaptureFixture[str], *words: str) -> Path:
    assert main(["run", *words]) == 0
    return Path(capsys.readouterr().out.splitlines()[-1])


def test_many_columns_are_turned(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(capsys, "controller.k_p_w=1,1.1,1.2,1.3,1.4,1.5,1.6", "figures=null")
    assert lines[0].split()[:2] == ["ic1", "alpha_w"]
    assert [line.split()[0] for line in lines[1:]] == [f"controller.k_p_w={1 + i / 10:g}" for i in range(7)]


def test_two_studies(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("one", "two"):
        assert main(["init", name]) == 0
    capsys.readouterr()
    path = Path("two.yaml")
    path.write_text(path.read_text().replace("period_s: 10", "period_s: 120"))
    found = records(capsys, "one", "two", "horizon_min=60", "evaluation.stages=[sampled]", "figures=null")
    laws = ("pd", "pd_alpha", "pd_lag", "lqr")
    assert [record["law"] for record in found] == [f"{name} {law}" for name in ("one", "two") for law in laws]
    assert found[0]["delta_v_m_s"] != found[4]["delta_v_m_s"]


def test_a_directory_does_not_hide_the_study_of_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "my_study"]) == 0
    Path("my_study").mkdir()
    capsys.readouterr()
    assert main(["validate", "my_study"]) == 0
    assert capsys.readouterr().out.startswith("valid: my_study, ")
    assert not names_run("my_study")
    Path("my_study/run.json").touch()
    assert names_run("my_study")
    assert main(["validate", "my_study"]) == 1
    assert "holds no run: run.json is damaged" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 2, "'compare' needs something to compare"),
        (["outputs"], 2, "'outputs' holds no run; name directories that hold run.json"),
        (["controller=pd,pdq"], 3, "there is no controller 'pdq'"),
        (["no_study"], 2, "there is no no_study.yaml"),
        (["--jsn"], 2, "did you mean '--json'?"),
    ],
)
def test_what_cannot_be_compared_gets_a_sentence(
    capsys: pytest.CaptureFixture[str], words: list[str], code: int, said: str
) -> None:
    Path("outputs").mkdir()
    assert main(["compare", *words]) == code
    assert said in capsys.readouterr().err


def test_an_unfinished_run_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path("begun").mkdir()
    Path("begun/run.json").write_text('{"status": "running", "summary": null}')
    assert main(["compare", "begun"]) == 1
    assert "'begun' is not finished (status running)" in capsys.readouterr().err
