"""Workers of a Dask cluster, on this machine or on many, behind the interface of an executor.

Dask hands a call whose worker dies to another one, as often as its scheduler allows; then the call raises `WorkerLost`
here, as in processes of this machine.
"""

from __future__ import annotations

import logging
import pickle
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, Future
from contextlib import ExitStack, suppress
from functools import partial
from typing import Any, ParamSpec, TypeVar

from fracctl.config.cluster import TLS_FILES
from fracctl.errors import ConfigurationError, RunError
from fracctl.execution.dask_call import ANSWER, IDENTIFY, OtherProgram, difference, identify, packed, program
from fracctl.execution.dask_cluster import LocalCluster
from fracctl.execution.workers import WorkerError, WorkerExecutor, WorkerLost

_P = ParamSpec("_P")
_T = TypeVar("_T")

_LOOK_EVERY_S = 0.5
_KEPT = "what was computed is kept, and the same command continues"

_log = logging.getLogger(__name__)


class DaskExecutor(WorkerExecutor):
    """Calls importable functions in the workers of a Dask cluster.

    Args:
        scheduler: the fields of `fracctl.config.cluster.DaskScheduler`.
        cores: how many processes there are on this machine where `workers` is None.

    Raises:
        ConfigurationError: Dask is not installed.
        RunError: the scheduler does not answer, has no worker, or one of another kind.
    """

    def __init__(self, scheduler: Mapping[str, Any], cores: int) -> None:
        try:
            from distributed import Client, Security
            from distributed.utils import silence_logging_cmgr
        except ImportError as problem:
            raise ConfigurationError(
                f"scheduler=dask needs the package distributed ({problem}): pip install 'fracctl[dask]'"
            ) from None
        self._patience_s: float = scheduler["patience_s"]
        self._open = ExitStack()
        self._pending: set[Future[Any]] = set()
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._has_lost = False
        try:
            address = scheduler["address"]
            if address is None:
                cluster = LocalCluster(scheduler["workers"] or cores, self._patience_s)
                self._open.callback(cluster.close)
                address = cluster.address
            self._address: str = address
            self._open.enter_context(silence_logging_cmgr(logging.CRITICAL))
            self._client = self._connected(Client, self._security(scheduler, Security))
            self._open.callback(self._client.close, timeout=1)
            self._wait_for_workers(scheduler["workers"] if scheduler["address"] is None else None)
            self._check_workers()
        except BaseException:
            self._open.close()
            raise
        self._inner = self._client.get_executor(pure=False)
        self._watch = threading.Thread(target=self._look_after, name="fracctl-dask", daemon=True)
        self._watch.start()

    @property
    def workers(self) -> int:
        """Number of workers at the last look."""
        return max(1, self._n_workers)

    @property
    def in_flight(self) -> int:
        """After a death no call waits behind another, where it could be blamed for the next."""
        return self.workers if self._has_lost else super().in_flight

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Call an importable function in a worker."""
        outer: Future[_T] = Future()
        outer.set_running_or_notify_cancel()
        with self._lock:
            self._pending.add(outer)
        try:
            inner = self._inner.submit(eval, ANSWER, {"request": packed(fn, args, kwargs)})
        except Exception as problem:  # noqa: BLE001 - an executor hands every exception to its future
            self._fail(outer, RunError(f"{self._lost(problem)}; {_KEPT}"))
            return outer
        inner.add_done_callback(partial(self._hand_over, outer))
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster, or end it if it is this executor's own; `cancel_futures` abandons calls that run."""
        self._closing.set()
        with self._lock:
            pending = list(self._pending)
        if cancel_futures:
            self._inner.shutdown(wait=False)
        for future in pending:
            if cancel_futures:
                self._fail(future, WorkerLost("the run has ended"))
            elif wait:
                future.exception()
        self._watch.join()
        self._open.close()

    def _security(self, scheduler: Mapping[str, Any], security: Callable[..., Any]) -> Any:
        """Return what Dask needs for TLS: the files that were named, else those of its own configuration."""
        files = {name: scheduler[name] for name in TLS_FILES if scheduler[name] is not None}
        made = security(require_encryption=True, **files) if files else security()
        try:
            context = made.get_connection_args("client").get("ssl_context")
        except OSError as problem:
            raise ConfigurationError(
                f"{', '.join(files.values())}: no certificates and key for TLS ({problem}); PEM files are needed"
            ) from problem
        if context is None and self._address.startswith("tls://"):
            raise ConfigurationError(
                f"{self._address} needs certificates: give scheduler.tls_ca_file, scheduler.tls_client_cert and "
                "scheduler.tls_client_key, or Dask's own settings distributed.comm.tls"
            )
        return made

    def _connected(self, client: Callable[..., Any], security: Any) -> Any:
        try:
            return client(self._address, timeout=self._patience_s, security=security, set_as_default=False)
        except Exception as problem:
            raise RunError(
                f"no Dask scheduler answers at {self._address} ({_described(problem)}); start one by 'dask scheduler', "
                "and name the address that it prints as scheduler.address"
            ) from problem

    def _wait_for_workers(self, wanted: int | None) -> None:
        with suppress(TimeoutError):
            self._client.wait_for_workers(wanted or 1, timeout=self._patience_s)
        threads = self._client.nthreads()
        if not threads:
            raise RunError(self._no_worker())
        if wide := [f"{name} has {count}" for name, count in threads.items() if count != 1]:
            raise RunError(
                f"every Dask worker must have one thread ({wide[0]}): start them by "
                f"'dask worker {self._address} --nworkers N --nthreads 1'"
            )
        self._n_workers = len(threads)

    def _check_workers(self) -> None:
        """Have every worker say what it is before anything is computed."""
        kinds = {identify()[1]}
        for name, answer in self._client.run(eval, IDENTIFY, on_error="return").items():
            if isinstance(answer, BaseException):
                raise RunError(f"the Dask worker {name} cannot load fracctl ({_described(answer)}); {_CURE}")
            found, kind = answer
            if words := difference(program(), found):
                raise RunError(f"the Dask worker {name} has {words}, so its numbers may differ; {_CURE}")
            kinds.add(kind)
        if len(kinds) > 1:
            _log.warning("processors differ (%s): the last digits of a row may, too", "; ".join(sorted(kinds)))

    def _hand_over(self, outer: Future[Any], inner: Future[Any]) -> None:
        """Give the outcome of Dask's future to ours, in the words of an executor."""
        from distributed.scheduler import KilledWorker

        if inner.cancelled():
            self._fail(outer, RunError(f"{self._lost(CancelledError())}; {_KEPT}"))
            return
        problem = inner.exception()
        if problem is None:
            self._settle(outer, inner.result())
        elif isinstance(problem, KilledWorker):
            self._has_lost = True
            deaths = problem.allowed_failures + 1
            self._fail(outer, WorkerLost(f"its worker process died{f', {deaths} in a row' if deaths > 1 else ''}"))
        elif isinstance(problem, OtherProgram | ImportError):
            reason = f"has {problem}" if isinstance(problem, OtherProgram) else f"cannot load fracctl ({problem})"
            self._fail(outer, RunError(f"a Dask worker that has joined {reason}; {_CURE}; {_KEPT}"))
        else:
            self._fail(outer, WorkerError(f"{type(problem).__name__}: {problem}"))

    def _settle(self, future: Future[Any], answer: bytes) -> None:
        try:
            result = pickle.loads(answer)
        except Exception as problem:  # noqa: BLE001 - an executor hands every exception to its future
            self._fail(future, WorkerError(f"its result cannot be read: {_described(problem)}"))
            return
        with self._lock:
            if future in self._pending:
                self._pending.discard(future)
                future.set_result(result)

    def _fail(self, future: Future[Any], problem: Exception) -> None:
        with self._lock:
            if future in self._pending:
                self._pending.discard(future)
                future.set_exception(problem)

    def _look_after(self) -> None:
        """Count the workers from time to time; give up when there has been none for the time of our patience."""
        seen, sentence = time.monotonic(), ""
        while not self._closing.wait(_LOOK_EVERY_S):
            try:
                self._n_workers, sentence = len(self._client.nthreads()), self._no_worker()
            except Exception as problem:  # noqa: BLE001 - Dask has many ways to say that nobody answers
                self._n_workers, sentence = 0, self._lost(problem)
            if self._n_workers:
                seen = time.monotonic()
            elif time.monotonic() - seen > self._patience_s:
                with self._lock:
                    pending = list(self._pending)
                for future in pending:
                    self._fail(future, RunError(f"{sentence}; {_KEPT}"))

    def _lost(self, problem: BaseException) -> str:
        return f"the Dask scheduler at {self._address} does not answer any more ({_described(problem)})"

    def _no_worker(self) -> str:
        return (
            f"the Dask scheduler at {self._address} has no worker for {self._patience_s:g} s; "
            f"start some by 'dask worker {self._address} --nworkers N --nthreads 1'"
        )


_CURE = "install the same packages there as here"


def _described(problem: BaseException) -> str:
    """Return an exception, or what caused it in the first place, in one line."""
    while problem.__cause__ is not None:
        problem = problem.__cause__
    return f"{type(problem).__name__}: {problem}".splitlines()[0].rstrip(": ")
