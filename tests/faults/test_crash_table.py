"""The crash table: whatever happens to a run, started once more it is complete and equal to the undisturbed one.

Every fault is a function that lets it happen to a run below a folder, and asserts what is said of it.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from fracctl.errors import RunError
from fracctl.execution.perform import RunResult, perform
from fracctl.store import RunDirectory
from tests.execution.fakes import N_BLOCKS, N_POINTS, fix_identity, job
from tests.execution.test_perform import Watch, tables_of
from tests.faults.processes import children_of, ended, fake_run, is_running, parts_in, until
from tests.store.disks import Died, dies_at, full_after, read_only, remounted_read_only, small_disk

LOCAL = {"type": "local", "workers": 2}
ONE = {"type": "local", "workers": 1}
SERIAL = {"type": "serial"}
LIMIT = {"time_limit": 8.0}
"""Above what the first block of a worker takes on a busy machine by far: blocks of the fake take milliseconds."""

Fault = Callable[[Path], None]


@pytest.fixture(autouse=True)
def _fixed_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    fix_identity(monkeypatch)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        fix_identity(patch)
        return perform(job(tmp_path_factory.mktemp("undisturbed"))).run_directory


@pytest.fixture(autouse=True)
def _no_worker_is_left() -> Iterator[None]:
    before = set(children_of(os.getpid()))
    yield
    assert set(children_of(os.getpid())) <= before


def log_of(folder: Path) -> str:
    return next(folder.glob("fake/*/run.log")).read_text()


# Workers.


def once(folder: Path, kind: str, *alphas: float) -> list[dict[str, Any]]:
    """Faults of some blocks that happen at the first attempt only."""
    return [{"kind": kind, "alpha_w": alpha, "once": str(folder / f"once {alpha}")} for alpha in alphas]


def is_tried_again(kind: str, scheduler: Mapping[str, Any]) -> Fault:
    def fault(folder: Path) -> None:
        found = perform(job(folder, LOCAL | dict(scheduler), faults=once(folder, kind, 0.8, 0.95)))
        assert found.summary["status"] == "finished"
        assert log_of(folder).count("is tried again") == 2

    return fault


def fails(kind: str, scheduler: Mapping[str, Any], reason: str) -> Fault:
    def fault(folder: Path) -> None:
        found = perform(job(folder, scheduler, faults=[{"kind": kind, "alpha_w": 0.8}]))
        assert_lacks_the_best(found, reason)

    return fault


def assert_lacks_the_best(found: RunResult, reason: str) -> None:
    """The block with the optimum has failed: rows with a reason, and another optimum that is not to be relied on."""
    failed = found.evaluations[found.evaluations["status"] == "failed"]
    assert failed["alpha_w"].unique().tolist() == [0.8]
    assert len(failed) == 2 * 441
    assert all(reason in text for text in failed["reason"].unique())
    assert found.optima["alpha_w"].min() == 0.85
    assert found.status == "incomplete"
    assert found.summary["failed_points"] == 441
    assert "882 of 4410 rows failed and are in no result" in found.summary["notes"]
    assert reason in found.summary["error"]


def all_workers_die(folder: Path) -> None:
    faults = [{"kind": "is killed", "alpha_w": alpha} for alpha in (0.8, 0.85, 0.9, 0.95, 1.0)]
    with pytest.raises(RunError, match="worker processes keep ending: its worker process was killed by signal 9"):
        perform(job(folder, ONE, faults=faults))


def all_workers_hang(folder: Path) -> None:
    faults = [{"kind": "hangs", "alpha_w": alpha} for alpha in (0.8, 0.85, 0.9, 0.95, 1.0)]
    with pytest.raises(RunError, match=r"every point failed: it took longer than scheduler.time_limit = 0.2 s"):
        perform(job(folder, LOCAL | {"time_limit": 0.2}, faults=faults))


# The process that was started.


@contextmanager
def hanging(folder: Path, scheduler: Mapping[str, Any], kind: str = "hangs") -> Iterator[subprocess.Popen[str]]:
    """A run in a process of its own that hangs in its third block; all others that it comes to are stored."""
    with ended(fake_run(folder, scheduler, faults=[{"kind": kind, "alpha_w": 0.9}])) as process:
        until(lambda: len(parts_in(folder)) == (2 if scheduler == SERIAL else N_BLOCKS - 1))
        assert len(children_of(process.pid)) == scheduler.get("workers", 0)
        yield process


def status_in(folder: Path) -> str | None:
    return RunDirectory(parts_in(folder)[0].parents[1]).status


def parent_is(sent: signal.Signals, scheduler: Mapping[str, Any], kind: str = "hangs") -> Fault:
    """A signal to the parent ends its workers within 5 seconds, though one of them hangs."""

    def fault(folder: Path) -> None:
        with hanging(folder, scheduler, kind) as process:
            workers = children_of(process.pid)
            process.send_signal(sent)
            process.wait()
            until(lambda: not any(is_running(pid) for pid in workers), seconds=5.0)
        assert status_in(folder) == "running"

    return fault


def ctrl_c(scheduler: Mapping[str, Any]) -> Fault:
    def fault(folder: Path) -> None:
        with hanging(folder, scheduler) as process:
            workers = children_of(process.pid)
            process.send_signal(signal.SIGINT)
            process.wait(timeout=5.0)
            assert not any(is_running(pid) for pid in workers)
            assert process.stderr is not None
            trace = process.stderr.read()
        assert trace.count("Traceback") == 1
        assert trace.rstrip().endswith("KeyboardInterrupt")
        assert status_in(folder) == "interrupted"

    return fault


def two_processes_at_once(folder: Path) -> None:
    with hanging(folder, SERIAL) as first, ended(fake_run(folder, SERIAL)) as second:
        _, said = second.communicate(timeout=60)
        assert second.returncode == 1
        assert f"RunError: another process ({first.pid}) is computing this run" in said


# Files.


def interrupted(folder: Path) -> Path:
    """The parts of a run that had all its blocks when it was interrupted."""
    with pytest.raises(KeyboardInterrupt):
        perform(job(folder), progress=Watch(interrupt_after=N_POINTS))
    assert len(parts_in(folder)) == N_BLOCKS
    return parts_in(folder)[0].parent


def part_is(damaged: Callable[[bytes], bytes], name: str = "000003.parquet") -> Fault:
    def fault(folder: Path) -> None:
        path = interrupted(folder) / name
        path.write_bytes(damaged(path.read_bytes()))

    return fault


def part_is_missing(folder: Path) -> None:
    (interrupted(folder) / "000003.parquet").unlink()


def part_of_another(folder: Path) -> None:
    parts = interrupted(folder)
    (parts / "000003.parquet").write_bytes((parts / "000002.parquet").read_bytes())


def flipped(content: bytes) -> bytes:
    place = len(content) // 2
    return content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :]


def truncated(content: bytes) -> bytes:
    return content[: len(content) // 2]


def finished_file_is(damaged: Callable[[bytes], bytes], name: str) -> Fault:
    def fault(folder: Path) -> None:
        path = perform(job(folder)).run_directory / name
        path.write_bytes(damaged(path.read_bytes()))

    return fault


def finished_file_is_missing(folder: Path) -> None:
    (perform(job(folder)).run_directory / "optima.parquet").unlink()


def disk_is_full(folder: Path) -> None:
    for n_bytes in (100, 3_000, 60_000, 120_000, 160_000, 250_000):
        with full_after(n_bytes), pytest.raises(RunError, match=r"cannot write .*: No space left on device; what was"):
            perform(job(folder))


def disk_is_read_only(folder: Path) -> None:
    with read_only(), pytest.raises(RunError, match=r"cannot write .*: Read-only file system; output_dir=DIR writes"):
        perform(job(folder))
    with pytest.raises(KeyboardInterrupt):
        perform(job(folder), progress=Watch(interrupt_after=1))
    with read_only(), pytest.raises(RunError, match=r"cannot write .*: Read-only file system; output_dir=DIR writes"):
        perform(job(folder))


def output_is_a_file(folder: Path) -> None:
    (folder / "fake").touch()
    with pytest.raises(RunError, match=r"cannot write .*fake.*: (Not a directory|File exists); output_dir=DIR writes"):
        perform(job(folder))
    (folder / "fake").unlink()


def killed_at_every_write(folder: Path) -> None:
    """Each attempt comes one part further; then they die at every write from ``run.json`` to the manifest."""
    for _ in range(3 * N_BLOCKS):
        with dies_at(3), pytest.raises(Died):
            perform(job(folder))
        if len(parts_in(folder)) == N_BLOCKS:
            break
    for write in range(8):
        with dies_at(write), pytest.raises(Died):
            perform(job(folder))
        assert len(parts_in(folder)) == N_BLOCKS


FAULTS: Mapping[str, Fault] = {
    "worker killed": is_tried_again("is killed", {}),
    "worker exits": is_tried_again("exits at once", {}),
    "worker hangs": is_tried_again("hangs", LIMIT),
    "worker hangs in a library": is_tried_again("hangs in a library", LIMIT),
    "worker always killed": fails("is killed", ONE, "its worker process was killed by signal 9"),
    "worker always exits": fails("exits at once", ONE, "its worker process ended with exit code 3"),
    "worker always hangs": fails("hangs", LOCAL | LIMIT, "it took longer than scheduler.time_limit = 8 s"),
    "worker raises": fails("raises", LOCAL, "ValueError: the fault was asked for"),
    "worker raises SystemExit": fails("exits", LOCAL, "SystemExit: 3"),
    "worker returns nonsense": fails("returns nonsense", LOCAL, "must return 882 values of nodes"),
    "worker returns what cannot be pickled": fails("returns what cannot be sent", LOCAL, "Can't"),
    "all workers killed": all_workers_die,
    "all workers hang": all_workers_hang,
    "parent killed": parent_is(signal.SIGKILL, LOCAL),
    "parent killed, worker hangs in a library": parent_is(signal.SIGKILL, LOCAL, "hangs in a library"),
    "parent terminated": parent_is(signal.SIGTERM, LOCAL),
    "parent killed, serial": parent_is(signal.SIGKILL, SERIAL),
    "Ctrl-C": ctrl_c(LOCAL),
    "Ctrl-C, serial": ctrl_c(SERIAL),
    "two processes at once": two_processes_at_once,
    "killed at every write": killed_at_every_write,
    "disk full": disk_is_full,
    "disk read-only": disk_is_read_only,
    "output is a file": output_is_a_file,
    "part truncated": part_is(truncated),
    "part with a flipped byte": part_is(flipped),
    "part empty": part_is(lambda content: b""),
    "part missing": part_is_missing,
    "part of another block": part_of_another,
    "digests truncated": part_is(truncated, "sha256"),
    "table with a flipped byte": finished_file_is(flipped, "evaluations.parquet"),
    "table truncated": finished_file_is(truncated, "optima.parquet"),
    "table missing": finished_file_is_missing,
    "run.json truncated": finished_file_is(truncated, "run.json"),
    "manifest truncated": finished_file_is(truncated, "manifest.sha256"),
}


SLOW = {
    "worker exits",
    "worker hangs in a library",
    "worker always hangs",
    "worker always exits",
    "worker raises SystemExit",
    "all workers hang",
    "parent terminated",
    "parent killed, serial",
    "Ctrl-C, serial",
}
"""Faults that another of the table is much like."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in FAULTS])
def test_after_a_fault_the_run_is_complete_and_equal(name: str, tmp_path: Path, undisturbed: Path) -> None:
    FAULTS[name](tmp_path)
    again = perform(job(tmp_path))
    assert again.status == "finished"
    assert tables_of(again.run_directory) == tables_of(undisturbed)
    assert RunDirectory(again.run_directory).verify() == []
    assert [path.name for path in again.run_directory.parent.iterdir()] == [again.run_directory.name]
    assert not (again.run_directory / "parts").exists()


@pytest.mark.parametrize("size", ["16k", "128k", "300k"])
def test_a_disk_that_is_really_full(tmp_path: Path, undisturbed: Path, size: str) -> None:
    with small_disk(tmp_path / "disk", size) as disk:
        with pytest.raises(RunError, match="No space left on device; what was computed is kept"):
            perform(job(disk))
        subprocess.run(["mount", "-o", "remount,size=10m", disk], check=True)
        assert tables_of(perform(job(disk)).run_directory) == tables_of(undisturbed)


def test_a_disk_that_is_really_read_only(tmp_path: Path, undisturbed: Path) -> None:
    with small_disk(tmp_path / "disk", "10m") as disk:
        with remounted_read_only(disk), pytest.raises(RunError, match="Read-only file system; output_dir=DIR writes"):
            perform(job(disk))
        with pytest.raises(KeyboardInterrupt):
            perform(job(disk), progress=Watch(interrupt_after=1))
        with remounted_read_only(disk), pytest.raises(RunError, match="Read-only file system; output_dir=DIR writes"):
            perform(job(disk))
        assert tables_of(perform(job(disk)).run_directory) == tables_of(undisturbed)
        with remounted_read_only(disk):
            assert perform(job(disk)).reused


def test_a_damaged_part_is_told_of(tmp_path: Path) -> None:
    part_is(flipped)(tmp_path)
    assert (
        "stored parts that could not be trusted and were computed again: 1" in perform(job(tmp_path)).summary["notes"]
    )
