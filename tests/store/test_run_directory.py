"""Run directories and their manifests."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from fracctl.errors import RunError
from fracctl.store import RunDirectory
from fracctl.store.columns import unit


@pytest.fixture
def run(tmp_path: Path) -> RunDirectory:
    directory = RunDirectory(tmp_path / "name" / "0123456789ab")
    directory.create()
    directory.write_run_json({"status": "finished", "configuration": {"name": "ä"}})
    directory.figures.mkdir()
    (directory.figures / "a b.pdf").write_bytes(b"%PDF")
    directory.parts.mkdir()
    (directory.parts / "000000.parquet").write_bytes(b"part")
    directory.write_manifest()
    return directory


def test_run_json_comes_back(run: RunDirectory) -> None:
    assert run.run_json == {"status": "finished", "configuration": {"name": "ä"}}
    assert run.status == "finished"


@pytest.mark.parametrize("content", [None, "", "[1]", '{"a"'])
def test_a_directory_without_a_run_is_one_sentence(tmp_path: Path, content: str | None) -> None:
    if content is not None:
        (tmp_path / "run.json").write_text(content)
    with pytest.raises(RunError, match="holds no run"):
        RunDirectory(tmp_path).run_json  # noqa: B018
    assert RunDirectory(tmp_path).status is None


def test_a_whole_run_verifies_and_so_says_sha256sum(run: RunDirectory) -> None:
    assert run.verify() == []
    subprocess.run(
        ["sha256sum", "--check", "--strict", "manifest.sha256"], cwd=run.path, check=True, capture_output=True
    )


def test_parts_the_log_and_later_files_are_not_in_the_manifest(run: RunDirectory) -> None:
    run.log.write_text("said")
    run.write_manifest()
    run.log.write_text("more")
    (run.parts / "000000.parquet").unlink()
    (run.path / "report.html").write_text("later")
    assert run.verify() == []


def test_damage_is_told(run: RunDirectory) -> None:
    (run.figures / "a b.pdf").write_bytes(b"%PDG")
    assert run.verify() == ["figures/a b.pdf has changed"]
    (run.figures / "a b.pdf").unlink()
    assert run.verify() == ["figures/a b.pdf is missing"]
    (run.path / "manifest.sha256").write_bytes(b"\xff")
    assert "cannot be read" in run.verify()[0]
    (run.path / "manifest.sha256").unlink()
    assert not run.has_manifest
    assert "cannot be read" in run.verify()[0]


def test_a_finished_run_is_set_aside_until_it_is_forgotten(run: RunDirectory) -> None:
    run.set_aside()
    assert not run.path.exists()
    assert len(list(run.path.parent.iterdir())) == 1
    run.create()
    run.set_aside()
    assert len(list(run.path.parent.iterdir())) == 1
    run.forget_aside()
    assert list(run.path.parent.iterdir()) == []


@pytest.mark.parametrize(
    ("column", "word"),
    [("tension_min", "1"), ("demanded_tension_min", "1"), ("tension_min_n", "N"), ("settling_time_1_m_min", "min")],
)
def test_a_least_tension_is_not_in_minutes(column: str, word: str) -> None:
    assert unit(column) == word


def test_the_report_is_in_no_manifest_and_goes_with_the_run_it_was_made_of(tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path / "run")
    directory.create()
    directory.write_run_json({"status": "finished"})
    directory.report.write_text("before", encoding="utf-8")
    directory.write_manifest()
    assert not directory.report.exists()
    directory.report.write_text("after", encoding="utf-8")
    assert directory.verify() == []
    assert (directory.path / "manifest.sha256").read_text(encoding="utf-8").count("\n") == 1
