"""One process at a time in a run directory."""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fracctl.errors import RunError
from fracctl.store.files import disk_errors

_UNSUPPORTED = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP}

_INSTANT_S = 0.2

_log = logging.getLogger(__name__)


@contextmanager
def exclusive(path: Path) -> Iterator[None]:
    """Hold the lock file `path`; the kernel releases it when the process ends, however that comes about.

    Raises:
        RunError: another process holds it.
    """
    with disk_errors(path):
        descriptor = _acquire(path)
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(descriptor)


def _acquire(path: Path) -> int:
    """Return the descriptor of the locked file; `holder` has it for an instant, which is waited for."""
    patience = time.monotonic() + _INSTANT_S
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            other = _written_in(descriptor)
            os.close(descriptor)
            if time.monotonic() < patience:
                time.sleep(_INSTANT_S / 20.0)
                continue
            raise RunError(f"another process ({other}) is computing this run; its lock is {path}") from None
        except OSError as problem:
            if problem.errno not in _UNSUPPORTED:
                os.close(descriptor)
                raise
            _log.warning("this file system has no locks: do not start the same run twice at once")
        if _is_still(path, descriptor):
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, str(os.getpid()).encode(), 0)
            return descriptor
        os.close(descriptor)


def _is_still(path: Path, descriptor: int) -> bool:
    """Whether the file that was locked is the one at `path`, not one that its last holder has just deleted."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def holder(path: Path) -> str | None:
    """Return the id of the process that holds the lock file `path`, None if none does."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _written_in(descriptor)
    except OSError:
        return None
    finally:
        os.close(descriptor)
    return None


def _written_in(descriptor: int) -> str:
    return os.pread(descriptor, 32, 0).decode(errors="replace").strip() or "unknown"
