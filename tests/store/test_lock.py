"""One process at a time in a run directory, and looking does not count."""

from __future__ import annotations

import fcntl
import os
import threading
import time
from pathlib import Path

import pytest

from fracctl.errors import RunError
from fracctl.store.lock import exclusive, holder


def looked_at(path: Path, seconds: float) -> threading.Thread:
    """Hold the lock as `holder` does, for longer, and give it back after a while."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT)
    fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)

    def give_back() -> None:
        time.sleep(seconds)
        os.close(descriptor)

    thread = threading.Thread(target=give_back)
    thread.start()
    return thread


def test_looking_for_the_holder_keeps_nobody_from_starting(tmp_path: Path) -> None:
    path = tmp_path / ".run.lock"
    looking = looked_at(path, 0.02)
    with exclusive(path):
        assert holder(path) == str(os.getpid())
    looking.join()
    assert holder(path) is None
    assert not path.exists()


def test_a_second_process_is_refused(tmp_path: Path) -> None:
    path = tmp_path / ".run.lock"
    with exclusive(path):
        with (
            pytest.raises(RunError, match=rf"another process \({os.getpid()}\) is computing this run"),
            exclusive(path),
        ):
            pass
        assert holder(path) == str(os.getpid())
