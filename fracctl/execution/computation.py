"""Computing one run: blocks, tables, trajectories, figures, summary, manifest."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from fracctl.errors import RunError
from fracctl.evaluation import COUNTERS, Conclusion
from fracctl.execution.cross_check import CrossCheck
from fracctl.execution.drawing import UNDRAWN, draw_figures
from fracctl.execution.executors import Executors
from fracctl.execution.frequency_response import frequency_responses
from fracctl.execution.gathering import Gathering
from fracctl.execution.lessons import lessons
from fracctl.execution.poles import COLUMNS as POLE_COLUMNS
from fracctl.execution.poles import Poles
from fracctl.execution.progress import Progress
from fracctl.execution.record import Record, run_log
from fracctl.execution.row_store import RowStore, evaluations_schema
from fracctl.execution.scheduler import Scheduler
from fracctl.execution.solving_again import solve_again
from fracctl.execution.summary import missing, notes_on, plain_tables, results, summarise
from fracctl.execution.tails import notes_on_tails
from fracctl.execution.trajectories import trajectories
from fracctl.execution.worker import Work, describe
from fracctl.execution.workers import WorkerExecutor
from fracctl.store.columns import schema
from fracctl.store.files import remove_tree
from fracctl.store.identity import canonical_json
from fracctl.store.run_directory import RunDirectory
from fracctl.surveys import Survey

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Job:
    """What a run computes."""

    configuration: Mapping[str, Any]
    """Plain data; `name`, `output_dir`, `scheduler`, `figures` and `seed` are read, the rest is recorded."""
    work: Work
    """The evaluation."""
    survey: Callable[[], Survey]
    """Makes the survey."""
    command: Mapping[str, Any] | None = None
    """What started it, plain data; recorded only. None where nothing is known of it."""


class Computation:
    """One run on its way to being finished.

    Args:
        job: what to compute.
        directory: where; what it holds already is not computed again.
        progress: is told.
        notes: sentences for the summary.
        executors: lend what computes it.
    """

    def __init__(
        self, job: Job, directory: RunDirectory, progress: Progress, notes: list[str], executors: Executors
    ) -> None:
        self._job, self._directory, self._progress, self._notes = job, directory, progress, notes
        self._executors = executors
        self._evaluation = job.work.evaluation()
        self._survey = job.survey()
        self._scheduler = job.configuration["scheduler"]
        directory.create()
        self._record = Record(directory, job.configuration, job.command)
        self._metadata = {
            "fracctl.configuration": canonical_json(job.configuration),
            "fracctl.provenance": canonical_json(self._record.provenance),
        }

    @property
    def _evaluations_schema(self) -> pa.Schema:
        return evaluations_schema(self._evaluation, self._survey.columns, self._metadata)

    def run(self) -> None:
        """Compute what is missing; afterwards the directory holds a finished or an incomplete run.

        Raises:
            RunError: nothing could be computed, or the disk is full or not writable.
            KeyboardInterrupt: Ctrl-C; what was computed is kept.
        """
        with self._ending_recorded():
            self._record.write("running")
            lent = self._executors.lent(self._scheduler, self._survey.n_points)
            with run_log(self._directory.log), lent as executor:
                self._record.provenance["workers"] = executor.workers
                summary = self._compute(executor)
            if summary["status"] != "finished":
                summary["notes"] += self._directory.kept
            self._record.write(summary["status"], summary, summary["error"])
            self._directory.write_manifest()
        if summary["status"] == "finished":
            remove_tree(self._directory.parts)
            self._directory.forget_aside()

    @contextmanager
    def _ending_recorded(self) -> Iterator[None]:
        try:
            yield
        except BaseException as problem:
            interrupted = isinstance(problem, KeyboardInterrupt)
            with suppress(RunError):
                if interrupted:
                    self._record.write("interrupted")
                else:
                    self._record.write("failed", error=describe(problem))
            if isinstance(problem, RunError) and self._directory.kept:
                raise RunError(f"{problem}; {self._directory.kept[0]}") from problem
            raise

    def _compute(self, executor: WorkerExecutor) -> dict[str, Any]:
        """Evaluate and conclude; workers check rows by another solver while this process writes and draws."""
        work, seed = self._job.work, int(self._job.configuration["seed"])
        check = CrossCheck(self._evaluation, seed, lambda rows: executor.submit(solve_again, work, rows))
        with self._directory.writing_evaluations(self._evaluations_schema) as write:
            gathering = Gathering(self._evaluation, self._survey, check, write)
            store = self._evaluate(executor, gathering)
        tally, optima = gathering.tally, gathering.optima()
        check.add_optima(optima)
        check.begin()
        poles = self._write_optima(optima)
        conclusion = self._conclude(check)
        self._trajectories()
        found = results(self._evaluation, optima)
        taught = [
            *notes_on_tails(self._evaluation, found),
            *lessons(self._evaluation, self._job.configuration, found),
        ]
        undrawn = draw_figures(self._directory, self._job.configuration["figures"], missing(store.failed_points))
        check.finish()
        self._record.foreign_cpu_time_s += check.foreign_cpu_time_s
        notes = self._notes + notes_on(found, self._survey.baseline, tally)
        if store.damaged:
            notes.append(f"stored parts that could not be trusted and were computed again: {store.damaged}")
        notes += [*taught, *check.notes(), *conclusion.notes, *undrawn]
        identity = {
            "experiment": str(self._job.configuration["name"]),
            "run_id": self._record.run_id,
            "run_directory": str(self._directory.path),
        }
        tables = {"tables": plain_tables(conclusion.shown)} if conclusion.shown else {}
        figures = {UNDRAWN: undrawn}
        return summarise(identity, store, found, notes) | figures | tables | check.summary() | poles.summary()

    def _evaluate(self, executor: WorkerExecutor, gathering: Gathering) -> RowStore:
        """Take the survey through the executor; rows are stored and gathered while workers compute the next."""
        store = RowStore(self._directory, self._evaluation, self._evaluations_schema, gathering.take)
        scheduler = Scheduler(self._survey, executor, self._job.work, store, self._progress)
        versions = self._record.provenance["versions"]
        _log.info("fracctl %s, %s, workers: %d", versions["fracctl"], self._scheduler["type"], executor.workers)
        self._progress.start(self._survey.n_points)
        try:
            scheduler.run()
            store.finish()
        finally:
            self._progress.finish()
            self._record.foreign_cpu_time_s = store.foreign_cpu_time_s
        _log.info("%d blocks: %d were stored, %d failed", store.blocks, store.continued, len(store.failures))
        if len(store.failures) == store.blocks:
            raise RunError(f"every point failed: {next(iter(store.failures.values()), 'there is none')}")
        return store

    def _write_optima(self, optima: list[dict[str, Any]]) -> Poles:
        """Complete the optima by their poles, and write both."""
        poles = Poles(self._evaluation)
        poles.add_to(optima)
        columns = ("kind", "slice", "objective_name", *self._evaluations_schema.names, *POLE_COLUMNS)
        self._directory.write_optima(schema(columns, COUNTERS, self._metadata), optima)
        rows = poles.rows()
        self._directory.write_poles(schema(tuple(rows), metadata=self._metadata), rows)
        return poles

    def _conclude(self, check: CrossCheck) -> Conclusion:
        """Store what the evaluation makes of all rows, and begin to check its best points."""
        conclusion = self._evaluation.conclude(self._directory.stream_evaluations())
        check.add_optima(conclusion.best)
        check.begin()
        for name, records in conclusion.tables.items():
            counts = [column for column, value in records[0].items() if type(value) is int]
            self._directory.write_table(name, schema(tuple(records[0]), counts, self._metadata), records)
        return conclusion

    def _trajectories(self) -> None:
        optima = self._directory.optima()
        shown = optima[optima["kind"].isin(self._evaluation.trajectory_kinds)]
        times = np.linspace(0.0, self._evaluation.horizon, self._evaluation.trajectory_samples)
        rows = trajectories(self._evaluation, shown, times)
        self._directory.write_trajectories(schema(tuple(rows), metadata=self._metadata), rows)
        if self._evaluation.has_poles:
            responses = frequency_responses(self._evaluation, shown)
            self._directory.write_frequency_response(schema(tuple(responses), metadata=self._metadata), responses)
