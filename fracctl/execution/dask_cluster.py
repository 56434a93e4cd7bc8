"""A Dask cluster on this machine, for `scheduler=dask` without an address.

Scheduler and workers are fresh interpreters, as `fracctl.execution.processes` starts them: nothing is forked, a script
needs no main guard, Ctrl-C in a terminal reaches the parent only, and they end when the parent does, however that ends.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from fracctl.errors import RunError
from fracctl.execution.threads import SINGLE_THREAD

_PROGRAM = """
import sys
sys.path[:] = {path!r}
from fracctl.execution.processes import watch_parent
watch_parent()
from distributed.cli.{command} import main
main({arguments!r})
"""
_SETTINGS = {
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0",
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0",
    "DASK_DISTRIBUTED__WORKER__MULTIPROCESSING_METHOD": "spawn",
}
"""A call whose worker dies comes back at once, for it is the survey's loop that counts attempts."""


class LocalCluster:
    """A scheduler and worker processes on the loopback interface; a worker that dies is replaced.

    Args:
        workers: how many worker processes.
        patience_s: how long the scheduler may take to start.

    Raises:
        RunError: it does not start.
    """

    def __init__(self, workers: int, patience_s: float) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="fracctl-dask-")
        self._processes: list[subprocess.Popen[bytes]] = []
        place = Path(self._folder.name)
        try:
            contact = place / "scheduler.json"
            self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(contact))
            self.address = self._address(contact, patience_s)
            options = ("--nworkers", str(workers), "--nthreads", "1", "--memory-limit", "0")
            self._start("dask_worker", self.address, *options, "--local-directory", str(place))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End all processes at once."""
        for process in self._processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            if process.stdin:
                process.stdin.close()
        self._folder.cleanup()

    def _start(self, command: str, *arguments: str) -> None:
        path = [str(entry) for entry in sys.path]
        program = _PROGRAM.format(path=path, command=command, arguments=[*arguments, "--no-dashboard"])
        with (Path(self._folder.name) / f"{command}.log").open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-c", program],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                env=os.environ | SINGLE_THREAD | _SETTINGS,
                process_group=0,
            )
        self._processes.append(process)

    def _address(self, contact: Path, patience_s: float) -> str:
        limit = time.monotonic() + patience_s
        while time.monotonic() < limit and self._processes[0].poll() is None:
            with suppress(FileNotFoundError, ValueError):
                return str(json.loads(contact.read_text(encoding="utf-8"))["address"])
            time.sleep(0.02)
        said = (Path(self._folder.name) / "dask_scheduler.log").read_text(errors="replace").strip().splitlines()
        reason = said[-1] if said else f"it has not answered after {patience_s:g} s"
        raise RunError(f"the Dask scheduler on this machine did not start ({reason}); scheduler=local does without")
