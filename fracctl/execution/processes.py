"""Worker processes, each at its own pipe.

A worker is a fresh interpreter: it does not import the user's script again, so scripts need no main guard, and its
linear algebra is limited to one thread before it is loaded. One that dies takes nothing with it but the call it was
busy with; one that is busy with a call for too long is killed. It ends when its pipe does, and on Linux the kernel
kills it, so it never outlives the parent, however that ends; and it is in a process group of its own, so Ctrl-C in a
terminal reaches the parent only.
"""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing.connection import Connection
from typing import Any, ParamSpec, TypeVar

from fracctl.execution.workers import OutOfTime, WorkerError, WorkerExecutor, WorkerLost

_P = ParamSpec("_P")
_T = TypeVar("_T")

_PROGRAM = "import sys; sys.path[:] = {path!r}; from fracctl.execution.processes import serve; serve({descriptor})"
_KILL_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of prctl(2)."""
_BEGUN = b""
"""What a worker says when it has loaded what a call needs, and begins with it."""


class ProcessExecutor(WorkerExecutor):
    """Calls functions in worker processes.

    Workers start when there is work for them, and are replaced when they die; the call they were busy with then
    raises `WorkerLost`.

    Args:
        workers: how many processes.
        environment: what they get beside this process's environment.
        time_limit: seconds that a call may take, else its worker is killed and it raises `OutOfTime`; None for any.
    """

    def __init__(
        self, workers: int, environment: dict[str, str] | None = None, time_limit: float | None = None
    ) -> None:
        self._size = workers
        self._environment = os.environ | (environment or {})
        self._time_limit = time_limit
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix="fracctl-worker")
        self._mine = threading.local()
        self._lock = threading.Lock()
        self._workers: set[_Worker] = set()
        self._closed = False

    @property
    def workers(self) -> int:
        """Number of processes, once there is work for all."""
        return self._size

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Call an importable function in a worker."""
        return self._threads.submit(self._call, fn, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers: when all calls are done, or with `cancel_futures` at once, in the middle of theirs."""
        if cancel_futures:
            self._kill()
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        if wait:
            self._kill()
            for worker in self._workers:
                worker.end()
            self._workers.clear()

    def processes(self) -> list[int]:
        """Return the process ids of the workers that have started."""
        with self._lock:
            return [worker.process.pid for worker in self._workers]

    def _call(self, function: Callable[..., Any], args: Any, kwargs: Any) -> Any:
        worker = self._worker()
        try:
            return worker.call(pickle.dumps((function, args, kwargs), pickle.HIGHEST_PROTOCOL), self._time_limit)
        except WorkerLost:
            with self._lock:
                self._workers.discard(worker)
            del self._mine.worker
            raise

    def _worker(self) -> _Worker:
        """The worker of this thread."""
        if not hasattr(self._mine, "worker"):
            with self._lock:
                if self._closed:
                    raise WorkerLost("the run has ended")
                self._mine.worker = _Worker(self._environment)
                self._workers.add(self._mine.worker)
        worker: _Worker = self._mine.worker
        return worker

    def _kill(self) -> None:
        with self._lock:
            self._closed = True
            for worker in self._workers:
                worker.kill()


class _Worker:
    """One process and the parent's end of its pipe."""

    def __init__(self, environment: dict[str, str]) -> None:
        self._connection, theirs = multiprocessing.Pipe()
        with theirs:
            program = _PROGRAM.format(path=[str(entry) for entry in sys.path], descriptor=theirs.fileno())
            self.process = subprocess.Popen(
                [sys.executable, "-c", program],
                stdin=subprocess.PIPE,
                stdout=sys.__stderr__,
                pass_fds=(theirs.fileno(),),
                env=environment,
                process_group=0,
            )

    def call(self, request: bytes, time_limit: float | None) -> Any:
        try:
            self._connection.send_bytes(request)
            answer = self._connection.recv_bytes()
            if answer == _BEGUN:
                answer = self._answer_within(time_limit)
        except (EOFError, OSError):
            raise WorkerLost(self.end()) from None
        done, result = pickle.loads(answer)
        if not done:
            raise WorkerError(result)
        return result

    def _answer_within(self, time_limit: float | None) -> bytes:
        if not self._connection.poll(time_limit):
            self.kill()
            self.end()
            raise OutOfTime(f"it took longer than scheduler.time_limit = {time_limit:g} s; a larger one may help")
        return self._connection.recv_bytes()

    def kill(self) -> None:
        """Kill the process in the middle of its call."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)

    def end(self) -> str:
        """Let the process end, and return how it did."""
        self._connection.close()
        if self.process.stdin:
            self.process.stdin.close()
        code = self.process.wait()
        if code < 0:
            return f"its worker process was killed by signal {-code}"
        return f"its worker process ended with exit code {code}"


def serve(descriptor: int) -> None:
    """Be a worker: answer the calls that come through a pipe until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    watch_parent()
    with Connection(descriptor) as connection, contextlib.suppress(EOFError, OSError):
        while True:
            connection.send_bytes(_answer(connection.recv_bytes(), connection))


def _answer(request: bytes, connection: Connection) -> bytes:
    try:
        function, args, kwargs = pickle.loads(request)
        connection.send_bytes(_BEGUN)
        return pickle.dumps((True, function(*args, **kwargs)), pickle.HIGHEST_PROTOCOL)
    except (Exception, SystemExit) as problem:  # noqa: BLE001 - the parent is told
        return pickle.dumps((False, f"{type(problem).__name__}: {problem}"))


def watch_parent() -> None:
    """Make this process end with the one that holds the other end of its standard input.

    On Linux the kernel sees to it too, for a call that never lets another thread run.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_KILL_WITH_PARENT, signal.SIGKILL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Leave at once when the parent's end of standard input closes, also in the middle of a call."""
    while os.read(0, 1):
        pass
    os._exit(1)
