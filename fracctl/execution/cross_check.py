"""Rows solved again by an independent solver: the proof that a survey's numbers do not hang on one method."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future
from typing import Any

import numpy as np

from fracctl.arrays import Array
from fracctl.evaluation import Evaluation
from fracctl.execution.solving_again import Found
from fracctl.execution.workers import WorkerLost
from fracctl.surveys.base import Rows

_WORTHWHILE = 48
"""Rows that are worth a call of their own."""
_BATCH = 1024
_CHECKED = ("ok", "unsettled")

_log = logging.getLogger(__name__)


class CrossCheck:
    """Differences between two solvers on a random share of the rows and on all optima.

    The solvers disagree where positions or controls differ, relative to their peaks, by more than ten times the
    tolerance and by more than both error estimates together. Rows are solved piece by piece, those of equal orders
    together, for they share most of the work; the pieces depend on the rows alone. A piece whose worker dies is tried
    again, as often as `WorkerLost` says.

    Args:
        evaluation: its solver says which share of the rows is checked, and by which solver; none for a share of 0.
        seed: of the choice; the same rows are chosen whatever the scheduler.
        submit: begins to solve a piece again, by `solve_again`.
    """

    def __init__(self, evaluation: Evaluation, seed: int, submit: Callable[[Rows], Future[Found]]) -> None:
        self.rows = 0
        """Rows solved again."""
        self.worst = 0.0
        """Largest difference relative to the peak."""
        self.disagreements: list[str] = []
        """A sentence for each row on which the solvers disagree."""
        self.failures: list[str] = []
        """Why rows could not be solved again, piece by piece."""
        self.foreign_cpu_time_s = 0.0
        """CPU time that other processes spent."""
        self._evaluation, self._submit = evaluation, submit
        self._random = np.random.default_rng(seed)
        self._share = evaluation.solver.cross_check
        self._second = evaluation.solver.checked_by
        self._chosen: list[Rows] = []
        self._pending: list[tuple[Rows, Future[Found]]] = []

    def add(self, rows: Rows) -> None:
        """Choose a random share of further rows, which come in the order of the table."""
        if not self._share:
            return
        chosen = self._random.random(len(rows["status"])) < self._share
        stable = np.array([verdict is True for verdict in rows["stable"]], dtype=bool)
        self._choose(rows, np.flatnonzero(chosen & stable & np.isin(rows["status"], _CHECKED)))

    def add_optima(self, optima: Iterable[Mapping[str, Any]]) -> None:
        """Choose all optima."""
        found = [row for row in optima if row["stable"] is True]
        if self._share and found:
            self._choose({name: np.array([row[name] for row in found]) for name in found[0]}, np.arange(len(found)))

    def begin(self) -> None:
        """Begin to solve what was chosen; rows of all initial conditions together."""
        if self._chosen:
            names = [name for name in self._chosen[0] if all(name in part for part in self._chosen)]
            rows = {name: np.concatenate([part[name] for part in self._chosen]) for name in names}
            pieces = [{name: values[places] for name, values in rows.items()} for places in self._pieces(rows)]
            self._pending += [(piece, self._submit(piece)) for piece in pieces]
            self._chosen = []

    def finish(self) -> None:
        """Wait for all that was begun."""
        for piece, future in self._pending:
            found = self._awaited(piece, future)
            self.rows += found.rows
            self.worst = max(self.worst, found.worst)
            self.disagreements += found.disagreements
            self.foreign_cpu_time_s += found.cpu_time_s if found.process != os.getpid() else 0.0
            if found.reason is not None:
                self.failures.append(found.reason)
                _log.error("rows could not be solved again: %s\n%s", found.reason, found.trace)
        self._pending = []

    def notes(self) -> list[str]:
        """Return a sentence on what came out."""
        if not self._share:
            return []
        worst = f"worst difference {self.worst:.1e} of the peak"
        return [f"cross-check: {self.rows} rows solved by {self._second} too, {worst}"]

    def summary(self) -> dict[str, Any]:
        """Return what the summary of the run says of it; a disagreement fails the run, and so do rows left out."""
        if not self._share:
            return {}
        count = len(self.disagreements)
        found = {"solver": self._second, "rows": self.rows, "worst_difference": self.worst, "disagreements": count}
        if count:
            error = f"{count} of {self.rows} rows that two solvers computed do not agree, e.g. {self.disagreements[0]}"
        elif self.failures:
            error = f"the cross-check could not be completed ({self.failures[0]}); the same command tries it again"
        else:
            return {"cross_check": found}
        return {"cross_check": found, "status": "failed", "error": error}

    def _choose(self, rows: Rows, places: Array) -> None:
        if len(places):
            self._chosen.append({name: values[places] for name, values in rows.items()})

    def _pieces(self, rows: Rows) -> Iterator[Array]:
        """Yield places of rows of one law; rows of equal orders are parted only where they fill a batch."""
        for evaluation, places in self._evaluation.by_law(rows):
            parameters = evaluation.law.parameters(evaluation.plant.components)
            orders = [rows[one.name][places] for one in parameters if one.kind == "order"]
            keys = np.array([np.zeros(len(places)), *orders], dtype=np.float64)
            sequence = np.lexsort(keys)
            ends = 1 + np.flatnonzero(np.diff(keys[:, sequence]).any(axis=0))
            first = 0
            for end in [*ends.tolist(), len(places)]:
                if end - first >= _WORTHWHILE or end == len(places):
                    for start in range(first, end, _BATCH):
                        yield places[sequence[start : min(start + _BATCH, end)]]
                    first = end

    def _awaited(self, piece: Rows, future: Future[Found]) -> Found:
        attempt = 1
        while True:
            try:
                return future.result()
            except WorkerLost as problem:
                if attempt == problem.attempts:
                    return Found(0, reason=str(problem))
                _log.warning("rows are solved again once more: %s", problem)
            attempt += 1
            future = self._submit(piece)
