"""`fracctl resume`, and `fracctl validate` of a stored run: what is said, what is done, and with which exit code."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fracctl as fc
from fracctl.cli.main import main
from fracctl.config.compose import compose
from fracctl.errors import IncompleteRunWarning
from fracctl.evaluation import Evaluation
from fracctl.execution.run import execute
from fracctl.store import RunDirectory
from fracctl.store.lock import exclusive
from tests.execution.test_perform import Watch, tables_of

WORDS = ["experiment=ic1_outofplane", "survey.axes.alpha_w=[0.9,0.95,1.0]", "survey.axes.k_p_w=0:2:0.1"]
WORDS += ["survey.axes.k_d_w=0:2:0.1", "figures=[trajectories]", "scheduler=serial"]
N_POINTS = 3 * 441


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return execute(compose([*WORDS, f"output_dir={tmp_path_factory.mktemp('undisturbed')}"])).run_directory


def interrupted(folder: Path, after: int = 1) -> Path:
    """The directory of a run that was interrupted behind the block with the given point."""
    with pytest.raises(KeyboardInterrupt):
        execute(compose([*WORDS, f"output_dir={folder}"]), progress=Watch(interrupt_after=after))
    (directory,) = folder.glob("*/*")
    return directory


@pytest.fixture
def failing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The directory of a run whose block with the optimum, α = 0.9, has failed."""
    whole = Evaluation.__call__

    def fails(self: Evaluation, design: Any) -> Any:
        if np.unique(design["alpha_w"]).tolist() == [0.9]:
            raise MemoryError("out of memory")
        return whole(self, design)

    with monkeypatch.context() as patch:
        patch.setattr(Evaluation, "__call__", fails)
        with pytest.warns(
            IncompleteRunWarning, match=r"441 points could not be computed \(MemoryError: out of memory\)"
        ):
            found = fc.run("ic1_outofplane", [*WORDS[1:], f"output_dir={tmp_path}"])
    assert found.status == "incomplete"
    return found.run_directory


def errors(capsys: pytest.CaptureFixture[str], *words: str, code: int = 1) -> list[str]:
    assert main(words) == code
    return capsys.readouterr().err.splitlines()


def edit(path: Path, **changes: Any) -> None:
    """Change entries of ``run.json``."""
    run = RunDirectory(path)
    run.write_run_json(run.run_json | changes)


def test_an_interrupted_run_is_finished(tmp_path: Path, undisturbed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = interrupted(tmp_path)
    assert errors(capsys, "validate", str(directory)) == [
        f"error: {directory} was interrupted: 441 points of {N_POINTS} stored",
        f"error: 'fracctl resume {directory}' computes what is missing",
    ]
    assert main(["resume", str(directory)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert (lines[0], lines[-1]) == ("ic1_outofplane", str(directory))
    assert tables_of(directory) == tables_of(undisturbed)
    assert main(["validate", str(directory)]) == 0
    assert capsys.readouterr().out == f"valid: {directory} is finished, and every file is as it was written\n"


def test_a_finished_run_says_so(undisturbed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["resume", str(undisturbed)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "ic1_outofplane is finished already; nothing was computed",
        str(undisturbed),
    ]
    assert main(["resume", str(undisturbed), "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    found = json.loads(line)
    assert (found["status"], found["reused"], found["run_directory"]) == ("finished", True, str(undisturbed))


def test_a_run_that_was_moved_stays_where_it_is(tmp_path: Path, undisturbed: Path) -> None:
    directory = tmp_path / "elsewhere" / "my run"
    directory.parent.mkdir()
    interrupted(tmp_path / "first").rename(directory)
    assert main(["resume", str(directory), "--json"]) == 0
    assert tables_of(directory) == tables_of(undisturbed)
    summary = RunDirectory(directory).run_json["summary"]
    assert (summary["run_id"], summary["run_directory"]) == (undisturbed.name, str(directory))
    assert list((tmp_path / "first").glob("*/*")) == []


def test_failed_points_are_told_everywhere_and_tried_again(
    failing: Path, undisturbed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = RunDirectory(failing)
    optima = run.optima()
    assert optima["alpha_w"].min() == 0.95
    assert run.run_json["summary"]["failed_points"] == 441
    assert main(["list", "runs", f"output_dir={tmp_path}"]) == 0
    assert "  incomplete, 441 points missing  " in capsys.readouterr().out
    assert errors(capsys, "validate", str(failing)) == [
        f"error: {failing} is incomplete: 882 points of {N_POINTS} stored; {run.run_json['error']}",
        f"error: {failing}: the points of parts/000000.parquet failed: MemoryError: out of memory",
        f"error: 'fracctl resume {failing}' computes what is missing",
    ]
    assert b"incomplete" not in (undisturbed / "figures" / "trajectories.pdf").read_bytes()
    pictures = [(path / "figures" / "trajectories.png").read_bytes() for path in (failing, undisturbed)]
    heights = [int.from_bytes(picture[20:24], "big") for picture in pictures]
    assert heights[0] - heights[1] == pytest.approx(0.22 * 300, abs=1.0)
    assert main(["resume", str(failing)]) == 0
    assert tables_of(failing) == tables_of(undisturbed)
    assert (failing / "figures" / "trajectories.png").read_bytes() == pictures[1]


def test_a_result_that_lacks_points_says_so_on_the_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = Evaluation.__call__

    def fails(self: Evaluation, design: Any) -> Any:
        if design["alpha_w"][0] == 0.9:
            raise MemoryError("out of memory")
        return whole(self, design)

    monkeypatch.setattr(Evaluation, "__call__", fails)
    assert main(["run", *WORDS, f"output_dir={tmp_path}"]) == 1
    captured = capsys.readouterr()
    assert captured.out.splitlines()[0] == "ic1_outofplane, incomplete: 441 points missing"
    assert "note: 441 of 1323 rows failed and are in no result\n" in captured.out
    assert captured.err.startswith("error: 441 points could not be computed (MemoryError: out of memory)")
    assert main(["run", *WORDS, f"output_dir={tmp_path}", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert (found["status"], found["failed_points"]) == ("incomplete", 441)
    assert found["error"].startswith("441 points could not be computed")


def test_damage_is_named_with_its_cure(tmp_path: Path, undisturbed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = interrupted(tmp_path, after=N_POINTS)
    part = directory / "parts" / "000001.parquet"
    part.write_bytes(part.read_bytes()[:-7])
    assert errors(capsys, "validate", str(directory))[:2] == [
        f"error: {directory} was interrupted: 882 points of {N_POINTS} stored",
        f"error: {directory}: parts/000001.parquet cannot be trusted: its SHA-256 is not the one noted for it",
    ]
    assert part.exists()
    assert main(["resume", str(directory)]) == 0
    (directory / "optima.parquet").write_bytes(b"")
    (directory / "poles.parquet").unlink()
    capsys.readouterr()
    assert errors(capsys, "validate", str(directory)) == [
        f"error: {directory}: optima.parquet has changed",
        f"error: {directory}: poles.parquet is missing",
        f"error: 'fracctl resume {directory}' computes what is missing",
    ]
    assert main(["resume", str(directory)]) == 0
    assert tables_of(directory) == tables_of(undisturbed)


def test_other_sources_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = interrupted(tmp_path)
    provenance = RunDirectory(directory).run_json["provenance"]
    changed = {"sources": "0" * 64, "commit": "abc", "versions": provenance["versions"] | {"numpy": "1.0"}}
    edit(directory, run_id="0123456789ab", provenance=provenance | changed)
    (said,) = errors(capsys, "resume", str(directory))
    for part in (
        f"{directory} cannot be continued: it was begun with numpy 1.0, now {np.__version__}; other sources of fracctl",
        "(commit abc), so its id would be",
        "not 0123456789ab; go back to those, or begin it anew by 'fracctl run'",
    ):
        assert part in said
    assert "it cannot be continued: it was begun with numpy 1.0" in errors(capsys, "validate", str(directory))[-1]


def test_an_edited_configuration_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = interrupted(tmp_path)
    edit(directory, configuration=RunDirectory(directory).configuration | {"seed": 5})
    (said,) = errors(capsys, "resume", str(directory))
    assert "the configuration in run.json is not the one it was begun with" in said


def test_only_the_scheduler_may_be_changed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = interrupted(tmp_path)
    (said,) = errors(capsys, "resume", str(directory), "seed=1", code=2)
    assert said == "error: 'resume' takes keys of the scheduler only, not 'seed=1'; all else is as run.json says"
    (said,) = errors(capsys, "resume", str(directory), "scheduler.time_limit=5", code=3)
    assert said == (
        "error: scheduler.time_limit = 5: only worker processes can be stopped in the middle of a block; "
        "use scheduler=local"
    )
    assert main(["resume", str(directory), "scheduler=local", "scheduler.workers=1", "scheduler.time_limit=600"]) == 0
    scheduler = {"type": "local", "workers": 1, "time_limit": 600.0}
    assert RunDirectory(directory).configuration["scheduler"] == scheduler


def test_a_run_that_is_being_computed_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = interrupted(tmp_path)
    with exclusive(RunDirectory(directory).lock):
        (said,) = errors(capsys, "resume", str(directory))
        assert "another process" in said
        assert "is being computed by process" in errors(capsys, "validate", str(directory))[0]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (None, "run.json: No such file or directory; 'fracctl list runs' names those that are stored"),
        ('{"status": ', "run.json is damaged"),
        ("[]", "run.json is no mapping"),
        ('{"status": "running"}', "run.json has no configuration"),
    ],
)
@pytest.mark.parametrize("command", ["resume", "validate"])
def test_a_directory_without_a_run(
    command: str, content: str | None, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        (tmp_path / "run.json").write_text(content)
    (said,) = errors(capsys, command, str(tmp_path))
    assert said.startswith(f"error: {tmp_path} holds no run: {reason}")


def test_resume_needs_a_directory(capsys: pytest.CaptureFixture[str]) -> None:
    (said,) = errors(capsys, "resume", code=2)
    assert said == "error: 'resume' needs a run directory; 'fracctl list runs' names those that are stored"
