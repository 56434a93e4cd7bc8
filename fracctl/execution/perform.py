"""One run and its directory: compute it, continue it, or take it as it is stored."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fracctl.execution.computation import Computation, Job
from fracctl.execution.drawing import UNDRAWN, draw_figures
from fracctl.execution.executors import Executors
from fracctl.execution.progress import NoProgress, Progress
from fracctl.execution.restoring import restore_parts
from fracctl.execution.threads import single_threaded
from fracctl.store import RunDirectory, directory_of
from fracctl.store.files import make_directory
from fracctl.store.lock import exclusive
from fracctl.store.manifest import NAME

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class RunResult:
    """A run that is stored."""

    run_directory: Path
    """Absolute."""
    summary: dict[str, Any]
    """As ``--json`` prints it."""

    @property
    def reused(self) -> bool:
        """Whether it was there already and nothing was computed."""
        return bool(self.summary["reused"])

    @property
    def status(self) -> str:
        """``finished``; ``incomplete`` where points are missing, ``failed`` where a check of the result did."""
        return str(self.summary["status"])

    @cached_property
    def evaluations(self) -> pd.DataFrame:
        """Every evaluated point, read at first use."""
        return RunDirectory(self.run_directory).evaluations()

    @cached_property
    def optima(self) -> pd.DataFrame:
        """The optima by kind, slice and objective, read at first use."""
        return RunDirectory(self.run_directory).optima()


def perform(
    job: Job,
    *,
    fresh: bool = False,
    directory: RunDirectory | None = None,
    progress: Progress | None = None,
    executors: Executors | None = None,
) -> RunResult:
    """Compute a job, or return it where it is stored already; continue it where it is unfinished.

    Args:
        job: what to compute.
        fresh: compute again what is stored.
        directory: where it is stored; None for where its configuration says.
        progress: is told how far the run is.
        executors: lend worker processes to several runs; None for its own.

    Raises:
        RunError: it could not be computed or stored, or another process is computing it.
        KeyboardInterrupt: Ctrl-C; what was computed is kept, and the next call continues from it.
    """
    directory = directory or directory_of(job.configuration)
    if not fresh and is_whole(directory) and not _wants_other_figures(directory, job):
        return stored(directory)
    make_directory(directory.path.parent)
    with exclusive(directory.lock), single_threaded():
        if fresh or not is_whole(directory):
            notes = _prepare(directory, job, fresh)
            with nullcontext(executors) if executors else Executors() as lenders:
                Computation(job, directory, progress or NoProgress(), notes, lenders).run()
            return RunResult(directory.path, directory.run_json["summary"])
        return _redrawn(directory, job)


def is_whole(directory: RunDirectory) -> bool:
    """Return whether a run is finished and every file as it was written."""
    return directory.has_manifest and directory.status == "finished" and not directory.verify()


def _prepare(directory: RunDirectory, job: Job, fresh: bool) -> list[str]:
    """Leave in the directory only what can be trusted, and return notes on what could not.

    Parts have digests of their own. A finished run has none: they come from its evaluated points where these are whole.
    """
    damage = directory.verify() if directory.has_manifest else []
    if fresh:
        directory.set_aside()
    elif not damage:
        directory.remove_manifest()
    elif directory.parts.exists() and directory.status != "finished":
        directory.clear()
    elif _is_whole(directory.evaluations_path, damage):
        restore_parts(directory, job.survey())
        directory.clear()
        return [f"the stored run was damaged ({damage[0]}); all but its evaluated points has been made again"]
    else:
        directory.set_aside()
        return [f"the stored run was damaged ({damage[0]}) and has been computed again"]
    return []


def _is_whole(path: Path, damage: Sequence[str]) -> bool:
    """Whether a file is there, and no sentence of what is damaged is about it or the manifest."""
    return path.is_file() and not any(line.startswith((path.name, NAME)) for line in damage)


def stored(directory: RunDirectory) -> RunResult:
    """Return a finished run as it is stored."""
    summary = directory.run_json["summary"] | {"reused": True, "run_directory": str(directory.path)}
    return RunResult(directory.path, summary)


def _wants_other_figures(directory: RunDirectory, job: Job) -> bool:
    return bool(directory.run_json["configuration"]["figures"] != job.configuration["figures"])


def _redrawn(directory: RunDirectory, job: Job) -> RunResult:
    """Return a stored run with the figures asked for now; the record of them is written when they are there."""
    content = directory.run_json
    content["configuration"]["figures"] = job.configuration["figures"]
    content["command"] = job.command or content.get("command")
    summary = content["summary"]
    undrawn = draw_figures(directory, job.configuration["figures"])
    summary["notes"] = [note for note in summary["notes"] if note not in summary[UNDRAWN]] + undrawn
    summary[UNDRAWN] = undrawn
    directory.write_run_json(content)
    directory.write_manifest()
    return stored(directory)
