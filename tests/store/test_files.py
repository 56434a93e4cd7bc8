"""Files that are whole or not there, and locks."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from fracctl.errors import RunError
from fracctl.store.files import atomic, make_directory, write_bytes
from fracctl.store.lock import exclusive
from tests.store.disks import full_after


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_bytes(path, b"old")

    def interrupted() -> None:
        with atomic(path) as file:
            file.write(b"new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_sentence_and_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_bytes(path, b"old")
    with (
        full_after(10),
        pytest.raises(RunError, match=r"cannot write .*/a: No space left on device; what was computed"),
    ):
        write_bytes(path, b"x" * 11)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match=r"cannot write .*file.*; output_dir=DIR writes elsewhere"):
        make_directory(tmp_path / "file" / "run")


def test_a_lock_is_held_once(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with (
        exclusive(path),
        pytest.raises(RunError, match=r"another process \(\d+\) is computing this run"),
        exclusive(path),
    ):
        pass
    with exclusive(path):
        pass
    assert not path.exists()


def test_a_lock_dies_with_its_process(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    script = f"""
import os, pathlib
from fracctl.store.lock import exclusive
with exclusive(pathlib.Path({str(path)!r})):
    os._exit(9)
"""
    assert subprocess.run([sys.executable, "-c", script], cwd=Path(__file__).parents[2], check=False).returncode == 9
    assert path.exists()
    with exclusive(path):
        pass
