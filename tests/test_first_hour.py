"""The first hour of a new user, as docs/first_hour.md tells it."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pandas as pd
import pytest
import yaml

import fracctl as fc
from fracctl.cli.main import main
from fracctl.config.build import build_checked
from fracctl.config.catalogue import built_in_directory
from fracctl.config.compose import compose

PAGE = (Path(__file__).parents[1] / "docs" / "first_hour.md").read_text(encoding="utf-8")
COMMANDS = [
    shlex.split(line, comments=True)[1:]
    for block in re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)
    for line in block.splitlines()
    if line.startswith("fracctl ")
]
SHORT = ["horizon_min=60", "evaluation.period_s=60"]


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "my_study"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "my_study.yaml"
    return tmp_path / "my_study.yaml"


def test_a_study_is_never_overwritten(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study.write_text("mine")
    for word in ("my_study", "my_study.yaml"):
        assert main(["init", word]) == 2
        assert capsys.readouterr().err.startswith("error: 'my_study.yaml' is there already")
    assert study.read_text() == "mine"


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["init", "ic1_outofplane"], 2, "'ic1_outofplane' is the name of an experiment that there is already"),
        (["init", "3"], 2, "'3': the name of a study begins with a letter"),
        (["init", "none/mine"], 1, "'none/mine.yaml' cannot be written: No such file or directory"),
        (["run", "my_stdy"], 2, "there is no my_stdy.yaml; did you mean 'my_study'?"),
        (["run", "my_study", "other"], 2, "a run has one study, not 'my_study' and 'other'"),
        (["run", "my_study", "experiment=formation"], 3, "experiment is chosen twice"),
        (["validate", "my_study", "evaluation.laws.pd.values.k_p_x=1"], 3, "must name parameters of the law"),
        (["validate", "broken"], 3, "broken.yaml, line 1: not valid YAML"),
        (["validate", "listed"], 3, "listed.yaml: must be a mapping of keys"),
        (["validate", "base60"], 3, 'put it in quotes: "1:20:0.5"'),
        (["validate", "ic1_outofplane.yaml"], 3, "has the name of an experiment that there is already"),
    ],
)
def test_what_stumbles_gets_a_sentence(
    study: Path, capsys: pytest.CaptureFixture[str], words: list[str], code: int, said: str
) -> None:
    for name, text in (("other", ""), ("broken", "a: [1"), ("listed", "- 1"), ("ic1_outofplane", "name: x")):
        study.with_name(f"{name}.yaml").write_text(text)
    study.with_name("base60.yaml").write_text("survey:\n  type: grid\n  axes:\n    k_p_w: 1:20:0.5\n")
    assert main(words) == code
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.out == ""


def test_a_study_is_an_experiment_of_its_own(study: Path) -> None:
    named, by_file, from_elsewhere = (compose([word]) for word in ("my_study", "my_study.yaml", str(study)))
    assert named == by_file == from_elsewhere
    assert named.name == "my_study"
    evaluation, survey = build_checked(named)
    assert survey.n_points == 4
    assert evaluation.plant.chief.a_km == pytest.approx(6878.137)  # type: ignore[attr-defined]
    assert compose([]).name == "custom"  # nothing of the study is left behind


def test_the_study_says_what_its_keys_are() -> None:
    lines = (built_in_directory() / "study.yaml").read_text(encoding="utf-8").splitlines()
    assert sum("#" in line for line in lines) > 25
    assert max(map(len, lines)) <= 120
    content = yaml.safe_load("\n".join(lines))
    assert set(content["evaluation"]["laws"]) == {"pd", "pd_alpha", "pd_lag", "lqr"}
    assert content["initial_condition"]["start"]["units"] == "si"


def test_a_study_runs_and_keeps_paths(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "my_study", *SHORT]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "my_study"
    assert lines[1].split() == ["start,", "nonlinear", "pd", "pd_alpha", "pd_lag", "lqr"]
    directory = Path(lines[-1])
    assert {path.stem for path in (directory / "figures").iterdir()} == {"approach", "position_error"}
    laws, paths = (pd.read_parquet(directory / f"{name}.parquet") for name in ("laws", "paths"))
    assert laws["peak_force_n"].tolist() == pytest.approx((0.5 * laws["peak_acceleration_mm_s2"]).tolist())
    assert laws["peak_acceleration_mm_s2"].max() <= 10.0 * (1.0 + 1e-12)
    assert laws["propellant_kg"].between(0.1, 20.0).all()
    start = paths[paths["time"] == 0.0]
    assert start["law"].tolist() == laws["law"].tolist()
    evaluation, _ = build_checked(compose(["my_study", *SHORT]))
    scales = evaluation.plant.scales
    assert scales is not None
    assert (start["v"] * scales.length_m).tolist() == pytest.approx([-5000.0] * 4)
    flight = evaluation.fly("start", "nonlinear", [0], {"law_number": 3.0})  # type: ignore[attr-defined]
    times = paths[paths["law"] == "lqr"]["time"].to_numpy()
    assert paths[paths["law"] == "lqr"]["w"].to_numpy() == pytest.approx(flight(times)[0, :, 2], abs=1e-12)


def test_stages_stand_below_the_laws(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "my_study", *SHORT, "evaluation.stages=[ideal,sampled]", "figures=null"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("  start, sampled")
    below = next(line for line in lines[2:] if line.startswith("  start, orbits to 100 m"))
    assert below.split("  ")[2:4] == ["ideal", "sampled"]


def test_the_library_runs_a_study(study: Path) -> None:
    result = fc.run("my_study.yaml", [*SHORT, "figures=null", "evaluation.stages=[ideal]"])
    assert [row["law"] for row in result.summary["tables"]["laws"]] == ["pd", "pd_alpha", "pd_lag", "lqr"]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_commands_of_the_page_are_valid(study: Path, capsys: pytest.CaptureFixture[str], command: list[str]) -> None:
    if command[0] == "init":
        command = ["init", "my_other_study"]
    if command[0] == "run":
        command = ["validate", *command[1:]]
    if command[0] == "compare":
        assert len(command) > 1
        return  # computes; see test_compare
    assert main(command) == 0, capsys.readouterr().err


@pytest.mark.slow
def test_the_study_prints_what_the_page_prints(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (shown,) = re.findall(r"```console\n\$ fracctl run my_study\n(.*?)…", PAGE, flags=re.DOTALL)
    assert main(["run", "my_study"]) == 0
    assert capsys.readouterr().out.startswith(shown)


def test_json_keys_are_those_of_the_page(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every command that prints data prints the documented keys, and nothing else."""
    grid = ["survey=out_of_plane", "survey.axes.alpha_w=1", "survey.axes.k_p_w=[1.0,2.0]", "survey.axes.k_d_w=2"]
    commands = {
        "run": ["run", *grid, "figures=null"],
        "compare": ["compare", *grid, "figures=null"],
        "list": ["list", "plant"],
        "list runs": ["list", "runs"],
        "show": ["show", "my_study"],
        "validate": ["validate", "my_study"],
        "export": ["export", "--to", "out", "controller.k_p_w=1"],
    }
    documented = dict(re.findall(r"^\| `([a-z ]+)` \| (.*) \|$", PAGE, flags=re.MULTILINE))
    assert set(documented) == {*commands, "reproduce"}
    for name, words in commands.items():
        assert main([*words, "--json"]) == 0
        captured = capsys.readouterr()
        assert captured.err == ""
        keys = {key for line in captured.out.splitlines() for key in json.loads(line)}
        said = set(re.findall(r"`(\w+)`", documented[name]))
        assert said - keys <= {"tables", "run_directory", "status"}, name
        assert keys <= said or name in ("compare", "run"), name
