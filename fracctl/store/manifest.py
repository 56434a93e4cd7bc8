"""``manifest.sha256``: the digests of the files of a run that has ended, as ``sha256sum --check`` reads them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from fracctl.store.files import TEMPORARY, disk_errors, sha256, write_bytes

NAME = "manifest.sha256"
PARTS = "parts"
REPORT = "report.html"
"""Made of a run at any time, and no part of it."""
LOG = "run.log"
"""Nothing is made of it; whoever writes into it changes no result."""
NEW_FIGURES = f"figures{TEMPORARY}"
"""Figures that are being drawn."""
_LEFT_OUT = (NAME, PARTS, REPORT, LOG, NEW_FIGURES)


def write(directory: Path) -> None:
    """Write the manifest over all files but parts, the report and the log."""
    with disk_errors(directory):
        lines = [f"{sha256(path)}  {path.relative_to(directory).as_posix()}\n" for path in _files(directory)]
    write_bytes(directory / NAME, "".join(lines).encode())


def verify(directory: Path) -> list[str]:
    """Return a sentence for everything that is not as the manifest says; files it does not name are not looked at."""
    try:
        lines = (directory / NAME).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        return [f"{NAME} cannot be read: {problem}"]
    return [sentence for line in lines if (sentence := _problem(directory, line))]


def _problem(directory: Path, line: str) -> str | None:
    digest, _, name = line.partition("  ")
    if not name:
        return f"{NAME} has a damaged line"
    try:
        return None if sha256(directory / name) == digest else f"{name} has changed"
    except FileNotFoundError:
        return f"{name} is missing"
    except OSError as problem:
        return f"{name} cannot be read: {problem.strerror}"


def _files(directory: Path) -> Iterator[Path]:
    for path in sorted(directory.rglob("*")):
        parts = path.relative_to(directory).parts
        if path.is_file() and parts[0] not in _LEFT_OUT and path.suffix != TEMPORARY:
            yield path
