"""What a run writes about itself while it goes on: ``run.json`` and ``run.log``."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fracctl.store.files import disk_errors
from fracctl.store.identity import run_id
from fracctl.store.provenance import provenance
from fracctl.store.run_directory import RunDirectory


class Record:
    """Keeps ``run.json`` of one computation; times add up over continuations.

    Args:
        directory: of the run.
        configuration: plain data.
        command: that started it; None for the one of the computation that this one continues.
    """

    def __init__(
        self, directory: RunDirectory, configuration: Mapping[str, Any], command: Mapping[str, Any] | None = None
    ) -> None:
        self._directory = directory
        self._configuration = dict(configuration)
        self.run_id = run_id(configuration)
        content = directory.run_json if directory.status else {}
        self._command = command or content.get("command")
        before = content.get("provenance", {})
        self._wall_time_s = float(before.get("wall_time_s", 0.0))
        self._cpu_time_s = float(before.get("cpu_time_s", 0.0))
        self._started = (time.perf_counter(), time.process_time())
        self.provenance = provenance(configuration) | {"started": before.get("started") or _now()}
        self.foreign_cpu_time_s = 0.0

    def write(self, status: str, summary: Mapping[str, Any] | None = None, error: str | None = None) -> None:
        """Write the state of the run."""
        wall, cpu = self._started
        times = {
            "written": _now(),
            "wall_time_s": round(self._wall_time_s + time.perf_counter() - wall, 3),
            "cpu_time_s": round(self._cpu_time_s + time.process_time() - cpu + self.foreign_cpu_time_s, 3),
        }
        content = {
            "status": status,
            "run_id": self.run_id,
            "command": self._command,
            "configuration": self._configuration,
            "provenance": self.provenance | times,
            "summary": summary,
            "error": error,
        }
        self._directory.write_run_json(content)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


class _FileHandler(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        """Say nothing: a full disk is told by what cannot be stored, not by the log."""


@contextmanager
def run_log(path: Path) -> Iterator[None]:
    """Append what the package logs to a file meanwhile."""
    logger = logging.getLogger("fracctl")
    with disk_errors(path):
        handler = _FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    level = logger.level
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
        with suppress(OSError):
            handler.close()
