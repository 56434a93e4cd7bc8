"""Runs in processes of their own, to be killed or interrupted from outside, and what they leave behind."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]

_SCRIPT = """
import sys
from pathlib import Path
from fracctl.execution.perform import perform
import pytest
from tests.execution.fakes import fix_identity, job

fix_identity(pytest.MonkeyPatch())
{body}
"""


def script(body: str, **values: Any) -> str:
    """A program that computes the fake run."""
    return _SCRIPT.format(body=body.format(**values))


def fake_run(folder: Path, scheduler: Mapping[str, Any], **data: Any) -> subprocess.Popen[str]:
    """Start the fake run in a process of its own."""
    body = script(
        "perform(job(Path({folder!r}), {scheduler!r}, **{data!r}))", folder=str(folder), scheduler=scheduler, data=data
    )
    return subprocess.Popen([sys.executable, "-c", body], cwd=ROOT, stderr=subprocess.PIPE, text=True)


@contextmanager
def ended(process: subprocess.Popen[str]) -> Iterator[subprocess.Popen[str]]:
    """Whatever happens meanwhile, the process has ended afterwards."""
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        if process.stderr is not None:
            process.stderr.close()  # unread: a worker that outlives its parent holds it open


def parts_in(folder: Path) -> list[Path]:
    """Parts of the runs below a folder."""
    return sorted(folder.glob("*/*/parts/*.parquet"))


def until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    """Wait for a condition."""
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit, "waited in vain"
        time.sleep(0.01)


def children_of(pid: int) -> list[int]:
    """Running children of a process."""
    listing = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for path in listing for child in path.read_text().split()]


def is_running(pid: int) -> bool:
    """Whether there is such a process, and it is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False
