"""Parts of a finished run from its table of evaluated points, so that only what was made of them is made again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from fracctl.arrays import Array
from fracctl.store import tables
from fracctl.store.columns import to_rows
from fracctl.store.parts import Parts
from fracctl.store.run_directory import RunDirectory
from fracctl.surveys import Block, Survey
from fracctl.surveys.base import POINT


def restore_parts(directory: RunDirectory, survey: Survey) -> None:
    """Write the part of each block that the survey asks for; ends where the table does not go on with its points.

    Args:
        directory: of a run whose ``evaluations.parquet`` is as it was written.
        survey: a new one, which is told what it asks for.
    """
    parts = Parts(directory.parts, pq.read_schema(directory.evaluations_path))
    rows = _Rows(tables.stream(directory.evaluations_path))
    blocks = survey.ask()
    while blocks:
        for block in blocks:
            found = rows.of(block)
            if found is None:
                return
            parts.save(block.number, found)
            survey.tell(block.number, found)
        blocks = survey.ask()


class _Rows:
    """The rows of a table, block by block, in the order of their points."""

    def __init__(self, pieces: Iterator[pa.Table]) -> None:
        self._pieces = pieces
        self._rest: pa.Table | None = None

    def of(self, block: Block) -> dict[str, Array] | None:
        """Return the rows of the next block, None where the next rows are those of other points."""
        found, beyond = [], block.first_point + block.size
        while (table := self._next()) is not None:
            points = table.column(POINT).to_numpy()
            after = np.flatnonzero(points >= beyond)
            end = int(after[0]) if after.size else len(points)
            found.append(table.slice(0, end))
            if end < len(points):
                self._rest = table.slice(end)
                break
        rows = to_rows(pa.concat_tables(found)) if found else {}
        return rows if rows and np.unique(rows[POINT]).size == block.size else None

    def _next(self) -> pa.Table | None:
        table, self._rest = self._rest, None
        return next(self._pieces, None) if table is None else table
