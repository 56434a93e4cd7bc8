"""Disks that are full: a simulated one, and a real one where the system lets us have it."""

from __future__ import annotations

import errno
import io
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import pytest

from fracctl.store import files


class _FullDisk(io.FileIO):
    def __init__(self, path: Path, room: list[int]) -> None:
        super().__init__(path, "w")
        self._room = room

    def write(self, data: object) -> int:
        size = memoryview(data).nbytes  # type: ignore[arg-type]
        if size > self._room[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self._room[0] -= size
        return super().write(data)  # type: ignore[arg-type]


@contextmanager
def full_after(n_bytes: int) -> Iterator[None]:
    """Every file that is written meanwhile finds room for `n_bytes` in all, then none."""
    room = [n_bytes]

    def open_for_writing(path: Path) -> BinaryIO:
        return io.BufferedWriter(_FullDisk(path, room))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "open_for_writing", open_for_writing)
        yield


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[Path]:
    """A file system of its own in memory; skips where mounting is not allowed."""
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], capture_output=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip("mounting a file system needs root")
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)
