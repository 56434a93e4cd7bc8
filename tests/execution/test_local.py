"""Worker processes: the same tables as in one process, and how they come and go."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from fracctl.execution.executors import Executors, InProcessExecutor, make_executor
from fracctl.execution.perform import perform
from fracctl.execution.processes import OutOfTime, ProcessExecutor, WorkerError, WorkerLost
from fracctl.execution.threads import single_threaded
from tests.execution.fakes import job
from tests.execution.test_perform import Watch, tables_of
from tests.faults.processes import ROOT, children_of, script, until

LOCAL = {"type": "local", "workers": 2}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return perform(job(tmp_path_factory.mktemp("undisturbed"))).run_directory


@pytest.fixture(autouse=True)
def no_worker_is_left() -> Iterator[None]:
    before = set(children_of(os.getpid()))
    yield
    assert set(children_of(os.getpid())) <= before


@pytest.mark.parametrize("workers", [1, 2])
def test_tables_are_bitwise_those_of_one_process(tmp_path: Path, undisturbed: Path, workers: int) -> None:
    found = perform(job(tmp_path, {"type": "local", "workers": workers}))
    assert found.summary["status"] == "finished"
    assert tables_of(found.run_directory) == tables_of(undisturbed)


def test_a_run_may_be_continued_by_another_scheduler(tmp_path: Path, undisturbed: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        perform(job(tmp_path, LOCAL), progress=Watch(interrupt_after=1))
    found = perform(job(tmp_path))
    assert "0 were stored" not in (found.run_directory / "run.log").read_text()
    assert tables_of(found.run_directory) == tables_of(undisturbed)


def test_the_parent_computes_with_one_thread_too() -> None:
    with threadpool_limits(2), single_threaded():
        assert {library["num_threads"] for library in threadpool_info()} == {1}


def test_workers_load_their_libraries_with_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    executor = make_executor(LOCAL, n_points=None)
    try:
        assert executor.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == "1"
    finally:
        executor.shutdown()


def test_an_executor_answers_raises_and_loses() -> None:
    executor = ProcessExecutor(2)
    try:
        assert executor.submit(divmod, 7, 2).result() == (3, 1)
        with pytest.raises(WorkerError, match="ZeroDivisionError"):
            executor.submit(divmod, 7, 0).result()
        with pytest.raises(WorkerError, match="pickle"):
            executor.submit(open, os.devnull).result()
        with pytest.raises(WorkerLost, match="exit code 4"):
            executor.submit(os._exit, 4).result()
        assert executor.submit(divmod, 7, 2).result() == (3, 1)
    finally:
        executor.shutdown()


def test_an_executor_kills_what_takes_too_long() -> None:
    executor = ProcessExecutor(1, time_limit=1.0)
    try:
        late, early = executor.submit(time.sleep, 60.0), executor.submit(divmod, 7, 2)
        with pytest.raises(OutOfTime, match=r"it took longer than scheduler.time_limit = 1 s; a larger one may help"):
            late.result()
        assert early.result() == (3, 1)
        assert len(executor.processes()) == 1
    finally:
        executor.shutdown()


class Loaded:
    """Comes out of a pickle as None, after a second."""

    def __reduce__(self) -> tuple[object, tuple[float]]:
        return time.sleep, (1.0,)


def test_loading_what_a_call_needs_counts_for_no_limit() -> None:
    executor = ProcessExecutor(1, time_limit=0.5)
    try:
        assert executor.submit(repr, Loaded()).result() == "None"
    finally:
        executor.shutdown()


@pytest.mark.parametrize(("limit", "kind"), [(None, InProcessExecutor), (60.0, ProcessExecutor)])
def test_a_single_point_has_a_process_where_it_may_have_to_be_killed(limit: float | None, kind: type) -> None:
    executor = make_executor(LOCAL | {"time_limit": limit}, n_points=1)
    executor.shutdown()
    assert type(executor) is kind


def test_an_executor_that_is_shut_down_kills_what_runs() -> None:
    executor = ProcessExecutor(1)
    futures = [executor.submit(time.sleep, 60.0), executor.submit(time.sleep, 60.0)]
    until(lambda: bool(executor.processes()))
    started = time.monotonic()
    executor.shutdown(cancel_futures=True)
    assert time.monotonic() - started < 1.0
    assert all(future.done() for future in futures)


def test_runs_share_their_workers(tmp_path: Path, undisturbed: Path) -> None:
    with Executors() as executors:
        for seed in (0, 1):
            found = perform(job(tmp_path, LOCAL, seed=seed), executors=executors)
            assert tables_of(found.run_directory) == tables_of(undisturbed)
            workers = set(children_of(os.getpid()))
            assert len(workers) == 2
            with executors.lent(LOCAL, n_points=None) as executor:
                assert isinstance(executor, ProcessExecutor)
                assert set(executor.processes()) == workers


def test_a_run_that_fails_takes_its_workers_with_it(tmp_path: Path, undisturbed: Path) -> None:
    with Executors() as executors:
        with pytest.raises(KeyboardInterrupt):
            perform(job(tmp_path, LOCAL), progress=Watch(interrupt_after=1), executors=executors)
        until(lambda: not children_of(os.getpid()))
        found = perform(job(tmp_path, LOCAL), executors=executors)
    assert tables_of(found.run_directory) == tables_of(undisturbed)


def test_a_worker_that_dies_between_runs_is_replaced(tmp_path: Path, undisturbed: Path) -> None:
    with Executors() as executors:
        perform(job(tmp_path, LOCAL, seed=1), executors=executors)
        os.kill(min(children_of(os.getpid())), signal.SIGKILL)
        found = perform(job(tmp_path, LOCAL), executors=executors)
    assert tables_of(found.run_directory) == tables_of(undisturbed)


@pytest.mark.parametrize("through", ["file", "argument", "standard input"])
def test_a_script_needs_no_main_guard(tmp_path: Path, through: str) -> None:
    body = "print(perform(job(Path({output!r}), {scheduler!r})).summary['status'])"
    text = script(body, output=str(tmp_path), scheduler=LOCAL)
    path = tmp_path / "script.py"
    path.write_text(f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{text}")
    command = {"file": [str(path)], "argument": ["-c", text], "standard input": ["-"]}[through]
    done = subprocess.run(
        [sys.executable, *command], cwd=ROOT, input=text, capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.stdout, done.stderr, done.returncode) == ("finished\n", "", 0)
