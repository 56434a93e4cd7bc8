"""From what became of a block to rows of the table, and back."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Mapping

import numpy as np
import pyarrow as pa

from fracctl.arrays import Array
from fracctl.evaluation import COUNTERS, Evaluation
from fracctl.execution.in_order import InOrder
from fracctl.execution.worker import Outcome
from fracctl.store.columns import REASON, TEXT, schema
from fracctl.store.parts import Parts
from fracctl.store.run_directory import RunDirectory
from fracctl.surveys import Block
from fracctl.surveys.base import POINT, Rows

FAILED = "failed"
"""Status of the points of a block that could not be computed."""

_log = logging.getLogger(__name__)


def evaluations_schema(evaluation: Evaluation, further: Iterable[str], metadata: Mapping[str, str]) -> pa.Schema:
    """Return the schema of ``evaluations.parquet``: `point`, the evaluation's columns, the survey's, `reason`."""
    return schema((POINT, *evaluation.row_columns, *further, REASON), COUNTERS, metadata)


class RowStore:
    """The parts of a run, written block by block, and handed on in the order of their numbers.

    Args:
        directory: of the run.
        evaluation: of the rows.
        table: schema of the rows.
        take: is handed the table of every block, those of failed ones too.
    """

    def __init__(
        self, directory: RunDirectory, evaluation: Evaluation, table: pa.Schema, take: Callable[[pa.Table], None]
    ) -> None:
        self._parts = Parts(directory.parts, table)
        self._ordered = InOrder(lambda number: next(self._parts.tables([number])), take)
        self._evaluation = evaluation
        self.blocks = 0
        """Number of blocks that are stored."""
        self.failures: dict[int, str] = {}
        """Blocks that could not be computed, with the reason."""
        self.failed_points = 0
        """Number of their points."""
        self.continued = 0
        """Number of blocks that were stored before."""
        self.foreign_cpu_time_s = 0.0
        """CPU time that other processes spent."""

    @property
    def damaged(self) -> int:
        """Number of stored parts that could not be trusted."""
        return self._parts.damaged

    def load(self, block: Block) -> Rows | None:
        """Return the rows of a block that was computed before, None if it is to be computed."""
        rows = self._parts.load(block.number)
        if rows is None:
            return None
        if any(rows[name][: block.size].tobytes() != values.tobytes() for name, values in block.design.items()):
            _log.warning("block %d is computed again: it was stored with other points", block.number)
            return None
        self.blocks += 1
        self.continued += 1
        self._ordered.add(block.number)
        return rows

    def save(self, block: Block, outcome: Outcome) -> Rows:
        """Store what became of a block and return its rows."""
        rows = dict(outcome.rows) if outcome.rows is not None else self._failed_rows(block, str(outcome.reason))
        n_conditions = len(self._evaluation.initial_conditions)
        rows[POINT] = block.first_point + rows.get(POINT, np.tile(np.arange(block.size), n_conditions))
        table = self._parts.save(block.number, rows, outcome.reason)
        self.blocks += 1
        self.foreign_cpu_time_s += outcome.cpu_time_s if outcome.process != os.getpid() else 0.0
        if outcome.reason is not None:
            self.failures[block.number] = outcome.reason
            self.failed_points += block.size
            _log.error("block %d failed: %s\n%s", block.number, outcome.reason, outcome.trace)
        self._ordered.add(block.number, table)
        return rows

    def finish(self) -> None:
        """Hand on what has waited for blocks that the survey has left out."""
        self._ordered.finish()

    def _failed_rows(self, block: Block, reason: str) -> dict[str, Array]:
        names = list(self._evaluation.initial_conditions)
        n_rows = block.size * len(names)
        rows: dict[str, Array] = {name: np.full(n_rows, np.nan) for name in self._evaluation.row_columns}
        unknown = set(rows) & {"stable", *TEXT, *COUNTERS}
        rows |= {name: np.full(n_rows, None, dtype=object) for name in unknown}
        rows |= {name: np.tile(values, len(names)) for name, values in block.design.items()}
        rows["initial_condition"] = np.repeat(np.array(names, dtype=object), block.size)
        rows["status"] = np.full(n_rows, FAILED, dtype=object)
        rows[REASON] = np.full(n_rows, reason, dtype=object)
        return rows
