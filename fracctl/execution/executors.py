"""Where blocks run: in this process, in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

from fracctl.execution.dask_executor import DaskExecutor
from fracctl.execution.processes import ProcessExecutor
from fracctl.execution.threads import SINGLE_THREAD
from fracctl.execution.workers import WorkerExecutor
from fracctl.store.identity import canonical_json

_P = ParamSpec("_P")
_T = TypeVar("_T")


class InProcessExecutor(WorkerExecutor):
    """Runs every call at once, where it is submitted."""

    workers = 1
    in_flight = 1

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Run the call and return its finished future."""
        future: Future[_T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as problem:  # noqa: BLE001 - an executor hands every exception to its future
            future.set_exception(problem)
        return future


def n_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def make_executor(scheduler: Mapping[str, Any], n_points: int | None) -> WorkerExecutor:
    """Return the executor of the configuration's `scheduler`; a single point with a time limit has its own process."""
    time_limit = scheduler.get("time_limit")
    if scheduler["type"] == "serial" or (n_points == 1 and time_limit is None):
        return InProcessExecutor()
    if scheduler["type"] == "dask":
        return DaskExecutor(scheduler, n_cores())
    workers = 1 if n_points == 1 else scheduler["workers"] or n_cores()
    return ProcessExecutor(workers, SINGLE_THREAD, time_limit)


class Executors:
    """The executors of runs that follow each other: worker processes stay for the next run on as many.

    A context manager; with it they end.
    """

    def __init__(self) -> None:
        self._idle: dict[tuple[bool, str], WorkerExecutor] = {}

    def __enter__(self) -> Executors:
        return self

    def __exit__(self, *_: object) -> None:
        for executor in self._idle.values():
            executor.shutdown()
        self._idle.clear()

    @contextmanager
    def lent(self, scheduler: Mapping[str, Any], n_points: int | None) -> Iterator[WorkerExecutor]:
        """Lend the executor of the configuration's `scheduler` for a run.

        An exception in the meantime shuts it down at once, in the middle of its calls.
        """
        key = n_points == 1, canonical_json(scheduler)
        executor = self._idle.pop(key, None) or make_executor(scheduler, n_points)
        try:
            yield executor
        except BaseException:
            executor.shutdown(cancel_futures=True)
            raise
        self._idle[key] = executor
