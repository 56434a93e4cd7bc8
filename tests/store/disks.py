"""Disks that are full or read-only, simulated and, where the system lets us mount them, real; a process that dies."""

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


class Died(BaseException):
    """The process has been killed."""


@contextmanager
def dies_at(write: int) -> Iterator[None]:
    """From the given write on, counted from 0, no file is written any more, as if the process had been killed there."""
    left = [write]

    def open_for_writing(path: Path) -> BinaryIO:
        left[0] -= 1
        if left[0] < 0:
            raise Died
        return path.open("wb")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "open_for_writing", open_for_writing)
        yield


@contextmanager
def read_only() -> Iterator[None]:
    """No file can be opened for writing meanwhile."""

    def open_for_writing(path: Path) -> BinaryIO:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "open_for_writing", open_for_writing)
        yield


@contextmanager
def remounted_read_only(disk: Path) -> Iterator[None]:
    """The file system of `small_disk` is read-only meanwhile."""
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
    try:
        yield
    finally:
        subprocess.run(["mount", "-o", "remount,rw", disk], check=True)


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
