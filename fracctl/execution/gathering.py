"""What a run takes from its rows while they come: the joined table, counts, optima, a share to solve again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pyarrow as pa

from fracctl.evaluation import Evaluation
from fracctl.execution.cross_check import CrossCheck
from fracctl.execution.summary import Tally
from fracctl.store.columns import to_rows
from fracctl.surveys import Optima, Survey


class Gathering:
    """Takes the tables of blocks in their order; holds no more of them than it has to tell.

    Args:
        evaluation: of the rows.
        survey: whose slices and baseline have optima.
        check: chooses rows to solve again.
        write: stores the tables.
    """

    def __init__(
        self, evaluation: Evaluation, survey: Survey, check: CrossCheck, write: Callable[[pa.Table], None]
    ) -> None:
        self.tally = Tally()
        """The rows by status."""
        self._check, self._write = check, write
        self._selection = Optima(
            evaluation.objectives,
            evaluation.design_variables,
            survey.slices,
            survey.baseline,
            any_single=not evaluation.has_poles,
        )

    def take(self, table: pa.Table) -> None:
        """Take further rows."""
        self._write(table)
        rows = to_rows(table)
        self.tally.add(rows)
        self._selection.add(rows)
        self._check.add(rows)

    def optima(self) -> list[dict[str, Any]]:
        """Return the optima of all rows."""
        return self._selection.rows()
