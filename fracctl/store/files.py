"""Writing files so that they are whole or not there, and saying in one sentence why that failed."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from fracctl.errors import RunError

TEMPORARY = ".tmp"
"""Suffix of a file that is being written."""

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


@contextmanager
def disk_errors(path: Path) -> Iterator[None]:
    """Turn an OSError into a RunError that names the path and the cure."""
    try:
        yield
    except OSError as problem:
        where = str(problem.filename or path).removesuffix(TEMPORARY)
        if problem.errno in _FULL:
            cure = "what was computed is kept, and the same command continues from it once there is room"
        else:
            cure = "output_dir=DIR writes elsewhere"
        raise RunError(f"cannot write {where}: {problem.strerror or problem}; {cure}") from problem


def open_for_writing(path: Path) -> BinaryIO:
    """Open a new file; every byte that is stored, `run.log` and figures apart, passes through here."""
    return path.open("wb")


@contextmanager
def atomic(path: Path) -> Iterator[BinaryIO]:
    """Yield a file that takes the place of `path` when all of it has reached the disk, or not at all."""
    temporary = path.with_name(path.name + TEMPORARY)
    with disk_errors(path):
        try:
            with open_for_writing(temporary) as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
            sync_directory(path.parent)
        except BaseException:
            with suppress(OSError):
                temporary.unlink()
            raise


def write_bytes(path: Path, content: bytes) -> None:
    """Write a whole file atomically."""
    with atomic(path) as file:
        file.write(content)


def sync_directory(path: Path) -> None:
    """Bring a directory's entries to the disk, so that a rename outlives a power cut."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_directory(path: Path) -> None:
    """Create a directory and those above it."""
    with disk_errors(path):
        path.mkdir(parents=True, exist_ok=True)


def move(path: Path, target: Path) -> None:
    """Rename within one file system."""
    with disk_errors(path):
        path.replace(target)
        sync_directory(target.parent)


def remove_tree(path: Path) -> None:
    """Delete a directory and all it holds, if it is there."""
    with disk_errors(path), suppress(FileNotFoundError):
        shutil.rmtree(path)


def sha256(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
