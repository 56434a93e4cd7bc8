"""Worker processes: the same tables as in one process, and what happens when they or their parent die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from fracctl.errors import RunError
from fracctl.execution.executors import Executors, make_executor
from fracctl.execution.perform import perform
from fracctl.execution.processes import ProcessExecutor, WorkerError, WorkerLost
from fracctl.execution.threads import single_threaded
from fracctl.store import RunDirectory
from tests.execution.fakes import N_BLOCKS, job
from tests.execution.test_perform import Watch, tables_of

ROOT = Path(__file__).parents[2]
LOCAL = {"type": "local", "workers": 2}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return perform(job(tmp_path_factory.mktemp("undisturbed"))).run_directory


def children() -> set[int]:
    """Running children of this process."""
    listing = Path(f"/proc/{os.getpid()}/task").glob("*/children")
    return {int(pid) for path in listing for pid in path.read_text().split()}


@pytest.fixture(autouse=True)
def no_worker_is_left() -> Iterator[None]:
    before = children()
    yield
    assert children() <= before


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


@pytest.mark.parametrize("kind", ["is killed", "exits at once"])
def test_a_block_whose_worker_dies_is_tried_again(tmp_path: Path, undisturbed: Path, kind: str) -> None:
    faults = [{"kind": kind, "alpha_w": alpha, "once": str(tmp_path / f"{alpha}")} for alpha in (0.8, 0.95)]
    found = perform(job(tmp_path, LOCAL, faults=faults))
    assert found.summary["status"] == "finished"
    assert (found.run_directory / "run.log").read_text().count("is tried again") == 2
    assert tables_of(found.run_directory) == tables_of(undisturbed)


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("is killed", "its worker process was killed by signal 9"),
        ("exits at once", "its worker process ended with exit code 3"),
        ("exits", "SystemExit: 3"),
        ("returns what cannot be sent", "Can't"),
    ],
)
def test_a_block_that_always_fails_harms_no_other(tmp_path: Path, kind: str, reason: str) -> None:
    found = perform(job(tmp_path, LOCAL | {"workers": 1}, faults=[{"kind": kind, "alpha_w": 0.9}]))
    failed = found.evaluations[found.evaluations["status"] == "failed"]
    assert failed["alpha_w"].unique().tolist() == [0.9]
    assert all(reason in text for text in failed["reason"].unique())
    assert found.summary["status"] == "incomplete"
    assert perform(job(tmp_path)).summary["status"] == "finished"


def test_workers_that_all_die_end_the_run(tmp_path: Path) -> None:
    faults = [{"kind": "is killed", "alpha_w": alpha} for alpha in (0.8, 0.85, 0.9, 0.95, 1.0)]
    with pytest.raises(RunError, match="worker processes keep ending: its worker process was killed by signal 9"):
        perform(job(tmp_path, LOCAL | {"workers": 1}, faults=faults))


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
            workers = children()
            assert len(workers) == 2
            with executors.lent(LOCAL, n_points=None) as executor:
                assert isinstance(executor, ProcessExecutor)
                assert set(executor.processes()) == workers


def test_a_run_that_fails_takes_its_workers_with_it(tmp_path: Path, undisturbed: Path) -> None:
    with Executors() as executors:
        with pytest.raises(KeyboardInterrupt):
            perform(job(tmp_path, LOCAL), progress=Watch(interrupt_after=1), executors=executors)
        until(lambda: not children())
        found = perform(job(tmp_path, LOCAL), executors=executors)
    assert tables_of(found.run_directory) == tables_of(undisturbed)


def test_a_worker_that_dies_between_runs_is_replaced(tmp_path: Path, undisturbed: Path) -> None:
    with Executors() as executors:
        perform(job(tmp_path, LOCAL, seed=1), executors=executors)
        os.kill(min(children()), signal.SIGKILL)
        found = perform(job(tmp_path, LOCAL), executors=executors)
    assert tables_of(found.run_directory) == tables_of(undisturbed)


# What follows runs in processes of its own.

SCRIPT = """
import sys
from pathlib import Path
from fracctl.execution.perform import perform
import pytest
from tests.execution.fakes import fix_identity, job

fix_identity(pytest.MonkeyPatch())
{body}
"""
LONG_RUN = "perform(job(Path({output!r}), {scheduler!r}, seconds=0.3, started={started!r}))"


def script(body: str, **values: Any) -> str:
    return SCRIPT.format(body=body.format(**values))


@contextmanager
def long_run(folder: Path, scheduler: dict[str, Any]) -> Iterator[subprocess.Popen[str]]:
    """A run of a second and a half in a process of its own, once its first part is stored."""
    body = script(LONG_RUN, output=str(folder), scheduler=scheduler, started=str(folder / "started"))
    process = subprocess.Popen([sys.executable, "-c", body], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    try:
        until(lambda: bool(list(folder.glob("fake/*/parts/*.parquet"))))
        yield process
    finally:
        process.kill()
        process.communicate()


def until(condition: Callable[[], bool], seconds: float = 20.0) -> None:
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.01)


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    listing = Path(f"/proc/{process.pid}/task").glob("*/children")
    return [int(pid) for path in listing for pid in path.read_text().split()]


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("scheduler", [LOCAL, {"type": "serial"}], ids=["local", "serial"])
def test_ctrl_c_ends_a_run_within_a_second(tmp_path: Path, undisturbed: Path, scheduler: dict[str, Any]) -> None:
    with long_run(tmp_path, scheduler) as process:
        workers = workers_of(process)
        started = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.wait(timeout=5.0)
        assert time.monotonic() - started < 1.0
        assert not any(is_running(pid) for pid in workers)
        assert process.stderr is not None
        trace = process.stderr.read()
    assert trace.count("Traceback") == 1
    assert trace.rstrip().endswith("KeyboardInterrupt")
    (directory,) = (tmp_path / "fake").iterdir()
    assert RunDirectory(directory).status == "interrupted"
    kept = len(list((directory / "parts").glob("*.parquet")))
    assert 0 < kept < N_BLOCKS
    assert tables_of(perform(job(tmp_path)).run_directory) == tables_of(undisturbed)
    assert f"{kept} were stored" in (directory / "run.log").read_text()


def test_a_killed_parent_leaves_no_worker_and_loses_no_part(tmp_path: Path, undisturbed: Path) -> None:
    with long_run(tmp_path, LOCAL) as process:
        workers = workers_of(process)
        assert len(workers) == 2
        process.kill()
        process.wait()
        until(lambda: not any(is_running(pid) for pid in workers), seconds=5.0)
    finished = perform(job(tmp_path))
    assert "0 were stored" not in (finished.run_directory / "run.log").read_text()
    assert tables_of(finished.run_directory) == tables_of(undisturbed)


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
