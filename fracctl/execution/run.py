"""One run from its configuration; callable without a command line."""

from __future__ import annotations

from fracctl.config.build import build_evaluation, build_survey
from fracctl.config.command import Command
from fracctl.config.schemas import RunConfig
from fracctl.execution.computation import Job
from fracctl.execution.executors import Executors
from fracctl.execution.perform import RunResult, perform
from fracctl.execution.progress import Progress
from fracctl.execution.worker import Work
from fracctl.store import RunDirectory

__all__ = ["RunResult", "execute"]


def execute(
    config: RunConfig,
    *,
    command: Command | None = None,
    fresh: bool = False,
    directory: RunDirectory | None = None,
    progress: Progress | None = None,
    executors: Executors | None = None,
) -> RunResult:
    """Compute a run, or return it where it is stored already; continue it where it is unfinished.

    Args:
        config: what to compute and where to store it.
        command: whose words lead to it, for a report; None where it is not known, or a stored run is continued.
        fresh: compute again what is stored.
        directory: where it is stored; None for where the configuration says.
        progress: is told how far the run is.
        executors: lend worker processes to several runs; None for its own.

    Raises:
        RunError: it could not be computed or stored, or another process is computing it.
        KeyboardInterrupt: Ctrl-C; what was computed is kept, and the next call continues from it.
    """
    plain = config.model_dump(mode="json")
    work = Work.of("fracctl.execution.configured:evaluation_of", plain)
    started = None if command is None else command.model_dump(mode="json")
    job = Job(plain, work, lambda: build_survey(config, build_evaluation(config)), started)
    return perform(job, fresh=fresh, directory=directory, progress=progress, executors=executors)
