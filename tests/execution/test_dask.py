"""A Dask cluster: the tables of one process, workers that die, a sentence for everything that is not as it must be."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from fracctl.errors import ConfigurationError, RunError
from fracctl.execution import dask_call
from fracctl.execution.executors import Executors, make_executor
from fracctl.execution.perform import RunResult, perform
from fracctl.execution.workers import WorkerError, WorkerExecutor
from fracctl.store import RunDirectory
from tests.execution.fakes import N_BLOCKS, job
from tests.execution.test_local import LOCAL
from tests.execution.test_perform import Watch, tables_of
from tests.faults.processes import ROOT, children_of, is_running, script, until

PATIENCE_S = 20.0
WITHOUT_FRACCTL = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "fracctl":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Blocked())
"""
OTHER_NUMPY = """
import importlib.metadata as metadata
def version(name, right=metadata.version):
    return "1.9.9" if name == "numpy" else right(name)
if metadata.version.__module__ != __name__:
    metadata.version = version
"""


def options(address: str | None = None, **further: Any) -> dict[str, Any]:
    tls = dict.fromkeys(("tls_ca_file", "tls_client_cert", "tls_client_key"))
    return {"type": "dask", "address": address, "workers": None, "patience_s": PATIENCE_S} | tls | further


HERE = options(workers=2)


@contextmanager
def started(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of Dask's command line, as a user starts it."""
    command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def scheduler(contact: Path, host: str, *further: str) -> Iterator[str]:
    """A scheduler; yields its address."""
    place = ("--host", host, "--port", "0", "--scheduler-file", str(contact))
    with started("scheduler", *place, *further):
        yield address_in(contact)


def address_in(contact: Path) -> str:
    until(lambda: contact.exists() and contact.read_text().strip().endswith("}"), seconds=60.0)
    return str(json.loads(contact.read_text())["address"])


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with scheduler(tmp_path_factory.mktemp("dask") / "scheduler.json", "127.0.0.1") as found:
        yield found


@contextmanager
def worker(address: str, folder: Path, *further: str) -> Iterator[subprocess.Popen[bytes]]:
    one = ("--nthreads", "1", "--no-nanny", "--memory-limit", "0", "--local-directory", str(folder))
    with started("worker", address, *one, *further) as process:
        yield process


def wait_for(address: str, count: int) -> None:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        until(lambda: len(client.nthreads()) == count, seconds=60.0)


@pytest.fixture
def two_workers(address: str, tmp_path: Path) -> Iterator[list[subprocess.Popen[bytes]]]:
    wait_for(address, 0)
    with worker(address, tmp_path) as one, worker(address, tmp_path) as other:
        wait_for(address, 2)
        yield [one, other]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return perform(job(tmp_path_factory.mktemp("undisturbed"), LOCAL)).run_directory


class Then(Watch):
    """Does something when the first block is stored."""

    def __init__(self, action: Callable[[], None]) -> None:
        super().__init__()
        self._action = action

    def advance(self, points: int) -> None:
        if not self.points:
            self._action()
        super().advance(points)


def check(found: RunResult, undisturbed: Path) -> None:
    assert found.summary["status"] == "finished"
    assert tables_of(found.run_directory) == tables_of(undisturbed)


def log(found: RunResult) -> str:
    return (found.run_directory / "run.log").read_text()


def test_a_worker_that_is_killed_changes_no_table(
    tmp_path: Path, address: str, two_workers: list[subprocess.Popen[bytes]], undisturbed: Path
) -> None:
    found = perform(job(tmp_path / "whole", options(address)))
    assert "dask, workers: 2" in log(found)
    check(found, undisturbed)
    with Executors() as executors:
        kill = Then(two_workers[0].kill)
        check(perform(job(tmp_path, options(address), seconds=0.3), progress=kill, executors=executors), undisturbed)
        assert two_workers[0].wait() == -signal.SIGKILL
        assert two_workers[1].poll() is None
        with executors.lent(options(address), n_points=None) as executor:
            until(lambda: executor.workers == 1)


def test_a_run_that_is_interrupted_keeps_what_is_done(
    tmp_path: Path, address: str, two_workers: list[subprocess.Popen[bytes]], undisturbed: Path
) -> None:
    with pytest.raises(KeyboardInterrupt):
        perform(job(tmp_path, options(address), seconds=0.2), progress=Watch(interrupt_after=1))
    assert all(one.poll() is None for one in two_workers)
    found = perform(job(tmp_path))
    assert "0 were stored" not in log(found)
    check(found, undisturbed)


def test_workers_that_all_go_end_the_run_with_a_sentence(
    tmp_path: Path, address: str, two_workers: list[subprocess.Popen[bytes]], undisturbed: Path
) -> None:
    gone = Then(lambda: [one.kill() for one in two_workers] and None)
    with pytest.raises(
        RunError, match=r"has no worker for 2 s; start some by 'dask worker .*what was computed is kept"
    ):
        perform(job(tmp_path, options(address, patience_s=2.0), seconds=0.3), progress=gone)
    check(perform(job(tmp_path)), undisturbed)


def test_a_scheduler_that_goes_ends_the_run_with_a_sentence(tmp_path: Path, undisturbed: Path) -> None:
    place = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(tmp_path / "scheduler.json"))
    with started("scheduler", *place) as process:
        address = address_in(tmp_path / "scheduler.json")
        with (
            worker(address, tmp_path),
            pytest.raises(RunError, match=r"Dask scheduler at tcp.*what was computed is kept"),
        ):
            perform(job(tmp_path, options(address, patience_s=3.0), seconds=0.3), progress=Then(process.kill))
    check(perform(job(tmp_path)), undisturbed)


@pytest.fixture(scope="module")
def here() -> Iterator[WorkerExecutor]:
    executor = make_executor(HERE, n_points=None)
    yield executor
    executor.shutdown()


def test_workers_load_their_libraries_with_one_thread(here: WorkerExecutor, monkeypatch: pytest.MonkeyPatch) -> None:
    assert here.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == "1"
    assert here.submit(blas_threads).result() == {1}


def blas_threads() -> set[int]:
    from threadpoolctl import threadpool_info

    return {library["num_threads"] for library in threadpool_info()}


def test_an_executor_answers_and_raises(here: WorkerExecutor) -> None:
    assert here.workers == 2
    assert here.in_flight == 4
    assert here.submit(divmod, 7, 2).result() == (3, 1)
    with pytest.raises(WorkerError, match="ZeroDivisionError"):
        here.submit(divmod, 7, 0).result()
    with pytest.raises(WorkerError, match="cannot pickle"):
        here.submit(threading.Lock).result()


def test_a_worker_that_joins_late_must_fit_too(here: WorkerExecutor, monkeypatch: pytest.MonkeyPatch) -> None:
    other = dask_call.program() | {"scipy": "0.1"}
    monkeypatch.setattr(dask_call, "program", lambda packages=(): other)
    with pytest.raises(RunError, match=r"a Dask worker that has joined has scipy .* instead of 0\.1"):
        here.submit(divmod, 7, 2).result()


def test_blocks_that_always_kill_their_workers_harm_no_other(tmp_path: Path) -> None:
    before = set(children_of(os.getpid()))
    found = perform(job(tmp_path, HERE, faults=[{"kind": "is killed", "alpha_w": 0.9}]))
    failed = found.evaluations[found.evaluations["status"] == "failed"]
    assert failed["alpha_w"].unique().tolist() == [0.9]
    assert failed["reason"].unique().tolist() == ["its worker process died"]
    assert found.summary["status"] == "incomplete"
    assert log(found).count("block 2 is tried again") == 2
    until(lambda: set(children_of(os.getpid())) <= before)
    assert perform(job(tmp_path)).summary["status"] == "finished"


def test_a_script_needs_no_main_guard_and_a_killed_parent_leaves_no_process(tmp_path: Path, undisturbed: Path) -> None:
    body = "perform(job(Path({output!r}), {scheduler!r}, seconds=0.3))"
    path = tmp_path / "script.py"
    path.write_text(
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{script(body, output=str(tmp_path), scheduler=HERE)}"
    )
    process = subprocess.Popen([sys.executable, str(path)], cwd=tmp_path)
    try:
        until(lambda: bool(list(tmp_path.glob("fake/*/parts/*.parquet"))), seconds=60.0)
        family = descendants(process.pid)
        assert len(family) >= 5  # scheduler, supervisor of the workers, its tracker, two workers
    finally:
        process.kill()
        process.wait()
    until(lambda: not any(is_running(pid) for pid in family), seconds=5.0)
    found = perform(job(tmp_path))
    assert "0 were stored" not in log(found)
    check(found, undisturbed)


def descendants(pid: int) -> list[int]:
    listing = Path(f"/proc/{pid}/task").glob("*/children")
    found = [int(child) for path in listing for child in path.read_text().split()]
    return found + [one for child in found for one in descendants(child)]


def test_a_single_point_needs_no_cluster() -> None:
    assert make_executor(options("tcp://127.0.0.1:9"), n_points=1).workers == 1


def test_without_the_package_one_sentence_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigurationError, match=r"needs the package distributed .*pip install 'fracctl\[dask\]'"):
        make_executor(HERE, n_points=None)


def test_a_scheduler_that_does_not_answer() -> None:
    begun = time.monotonic()
    with pytest.raises(
        RunError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9 .*start one by 'dask scheduler'"
    ):
        make_executor(options("tcp://127.0.0.1:9", patience_s=1.0), n_points=None)
    assert time.monotonic() - begun < 15.0


def test_a_cluster_without_workers(address: str) -> None:
    wait_for(address, 0)
    with pytest.raises(RunError, match="has no worker for 1 s; start some by 'dask worker"):
        make_executor(options(address, patience_s=1.0), n_points=None)


@pytest.mark.parametrize(
    ("further", "preloaded", "sentence"),
    [
        (["--nthreads", "2"], "", "every Dask worker must have one thread .* has 2.*--nworkers N --nthreads 1"),
        ([], WITHOUT_FRACCTL, r"cannot load fracctl \(ModuleNotFoundError: No module named 'fracctl'\); install"),
        ([], OTHER_NUMPY, r"has numpy 1\.9\.9 instead of .*; install the same packages there as here"),
    ],
    ids=["threads", "no fracctl", "another numpy"],
)
def test_workers_that_do_not_fit(
    address: str, tmp_path: Path, further: list[str], preloaded: str, sentence: str
) -> None:
    wait_for(address, 0)
    (tmp_path / "preloaded.py").write_text(preloaded)
    with worker(address, tmp_path, *further, "--preload", str(tmp_path / "preloaded.py")) as process:
        wait_for(address, 1)
        with pytest.raises(RunError, match=sentence):
            make_executor(options(address), n_points=None)
        assert process.poll() is None, "a worker that does not fit stays for others"


@pytest.mark.skipif(shutil.which("openssl") is None, reason="certificates are made by openssl")
def test_tls(tmp_path: Path, undisturbed: Path) -> None:
    certificate, key, junk = (str(tmp_path / name) for name in ("own.pem", "own.key", "junk.pem"))
    make = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=127.0.0.1"]
    alternative = ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out", certificate]
    subprocess.run([*make, *alternative], check=True, capture_output=True)
    Path(junk).write_text("junk")
    files = {"tls_ca_file": certificate, "tls_client_cert": certificate, "tls_client_key": key}
    tls = ("--tls-ca-file", certificate, "--tls-cert", certificate, "--tls-key", key)
    with scheduler(tmp_path / "scheduler.json", "tls://127.0.0.1", *tls) as address:
        assert address.startswith("tls://")
        with pytest.raises(ConfigurationError, match=r"needs certificates: give scheduler\.tls_ca_file"):
            make_executor(options(address), n_points=None)
        with pytest.raises(ConfigurationError, match=r"no certificates and key for TLS .*; PEM files are needed"):
            make_executor(options(address, **files | {"tls_ca_file": junk}), n_points=None)
        with pytest.raises(ConfigurationError, match=r"none\.pem.*: no certificates and key for TLS .*No such file"):
            make_executor(options(address, **files | {"tls_client_key": str(tmp_path / "none.pem")}), n_points=None)
        with pytest.raises(RunError, match=f"no Dask scheduler answers at tcp://{address[6:]}"):
            make_executor(options(f"tcp://{address[6:]}", patience_s=1.0), n_points=None)
        with worker(address, tmp_path, *tls):
            check(perform(job(tmp_path, options(address, **files))), undisturbed)


def test_nothing_loads_dask_unless_asked() -> None:
    code = "import sys, fracctl.execution.run, fracctl.cli.main as _; sys.exit('distributed' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


@pytest.mark.slow
def test_an_experiment_gives_the_tables_of_local_processes(
    tmp_path: Path, address: str, two_workers: list[subprocess.Popen[bytes]]
) -> None:
    """All of it by command lines, as a user would; one worker is killed on the way."""
    grid = ["survey=out_of_plane", "survey.axes.k_p_w=0.02:2:0.02", "survey.axes.k_d_w=0.02:2:0.02", "figures=null"]
    common = ["run", "name=survey", "solver.cross_check=0.01", *grid]
    command = [sys.executable, "-m", "fracctl", *common]
    local = subprocess.run([*command, "scheduler=local", f"output_dir={tmp_path}/local"], check=True, cwd=ROOT)
    assert local.returncode == 0
    process = subprocess.Popen(
        [*command, "scheduler=dask", f"scheduler.address={address}", f"output_dir={tmp_path}/dask"], cwd=ROOT
    )
    until(lambda: len(list((tmp_path / "dask").glob("survey/*/parts/*.parquet"))) > N_BLOCKS, seconds=120.0)
    two_workers[0].kill()
    assert process.wait(timeout=300.0) == 0
    (one,), (other,) = ((tmp_path / name / "survey").iterdir() for name in ("local", "dask"))
    assert one.name == other.name
    assert RunDirectory(other).status == "finished"
    assert tables_of(one) == tables_of(other)
