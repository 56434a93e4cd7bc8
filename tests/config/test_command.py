"""The command that is stored with a run: it leads to the same run from anywhere."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from fracctl.cli.main import main
from fracctl.config.catalogue import OWN_DIRECTORY
from fracctl.config.command import Command
from fracctl.config.compose import compose
from fracctl.execution.library import run
from fracctl.store import RunDirectory

POINT = ["controller.k_p_w=0.7", "figures=null"]


def directory_in(folder: Path) -> RunDirectory:
    (path,) = (path.parent for path in folder.rglob("run.json"))
    return RunDirectory(path)


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A directory of one's own with an experiment."""
    (tmp_path / "conf" / "experiment").mkdir(parents=True)
    text = "# Mine.\n# @package _global_\nname: mine\ncontroller:\n  alpha_w: 0.93\n"
    (tmp_path / "conf" / "experiment" / "own.yaml").write_text(text, encoding="utf-8")
    return tmp_path / "conf"


def test_the_line_leaves_out_where_a_run_is_computed_and_stored() -> None:
    words = ["experiment=ic1_outofplane", "scheduler=local", "+scheduler.workers=2", "output_dir=there", "name='a b'"]
    assert Command.of(words).line == "fracctl run experiment=ic1_outofplane 'name='\"'\"'a b'\"'\"''"
    assert shlex.split(Command.of(words).line)[3] == "name='a b'"


@pytest.mark.parametrize("by", ["option", "environment"])
def test_a_directory_of_ones_own_is_part_of_it(by: str, mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(mine.parent)
    given = Path("conf") if by == "option" else None
    if by == "environment":
        monkeypatch.setenv(OWN_DIRECTORY, "conf")
    command = Command.of(["experiment=own", "seed=3"], given)
    monkeypatch.delenv(OWN_DIRECTORY, raising=False)
    monkeypatch.chdir("/")
    assert command.line == f"fracctl run --config-dir {mine} experiment=own seed=3"
    assert command.compose() == compose(["experiment=own", "seed=3"], mine)
    assert Command.model_validate(command.model_dump(mode="json")) == command


def test_every_way_to_run_stores_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", *POINT, "output_dir=single"]) == 0
    assert directory_in(tmp_path / "single").run_json["command"]["words"] == [*POINT, "output_dir=single"]
    assert main(["run", "-m", "seed=4,5", *POINT, "output_dir=swept"]) == 0
    stored = [path.parent for path in (tmp_path / "swept").rglob("run.json")]
    assert sorted(RunDirectory(path).run_json["command"]["words"][0] for path in stored) == ["seed=4", "seed=5"]
    assert main(["compare", *POINT, "output_dir=compared"]) == 0
    assert directory_in(tmp_path / "compared").run_json["command"]["words"] == [*POINT, "output_dir=compared"]
    words = [*POINT, "output_dir=library", "survey=single"]
    result = run("ic1_outofplane", words)
    command = RunDirectory(result.run_directory).run_json["command"]
    assert command["words"] == ["experiment=ic1_outofplane", "scheduler=serial", *words]


def test_a_continued_run_keeps_it_and_other_figures_change_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", *POINT]) == 0
    directory = directory_in(tmp_path)
    directory.write_run_json(directory.run_json | {"status": "interrupted", "summary": None})
    directory.remove_manifest()
    assert main(["resume", str(directory.path)]) == 0
    assert directory.run_json["status"] == "finished"
    assert directory.run_json["command"]["words"] == POINT
    other = [POINT[0], "figures=trajectories"]
    assert main(["run", *other]) == 0
    assert directory.run_json["command"]["words"] == other
