"""What a survey is: it asks for blocks of design points, or of searches from them, and is told their rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from fracctl.arrays import Array, Floats

if TYPE_CHECKING:
    from fracctl.evaluation import Evaluation

Rows = Mapping[str, Array]
"""Rows of a table: arrays of one length by column name."""

POINT = "point"
"""Number of the design point in its survey; in the rows of a search, that of its start."""
SEARCHED_FOR = "searched_for"
"""Name of the objective whose search a row belongs to; None where it counts for all."""
EVALUATIONS_SPENT = "evaluations_spent"
"""How many evaluations the search of a row had spent when it came to it."""
SEARCH_COLUMNS = (SEARCHED_FOR, EVALUATIONS_SPENT)


class Search(Protocol):
    """Leads from starts to better points, all of it where the block runs; plain data, for it is sent there."""

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the path of the search.

        Args:
            evaluation: of design points.
            starts: every design variable by name, (b,).

        Returns:
            The evaluation's columns, `SEARCH_COLUMNS`, and `POINT`, the place of the row's start in `starts`: first
            the b starts in their order, then every improvement.
        """
        ...


@dataclass(frozen=True)
class Block:
    """Design points that are evaluated together, or searches from them; always as a whole."""

    number: int
    """Counts the survey's blocks from 0; also the name of the stored part."""
    first_point: int
    """Number of the first of its points in the survey; the others follow it."""
    design: Mapping[str, Floats]
    """Every design variable by name, (b,)."""
    search: Search | None = None
    """What starts from these points; None where they are evaluated only."""

    @property
    def size(self) -> int:
        """Number b of points."""
        return int(next(iter(self.design.values())).shape[0])


class Survey(Protocol):
    """Asks for blocks and is told their rows.

    Blocks depend on the survey alone: the same survey that is told the same rows asks for the same blocks, whatever
    the order in which it is told them, so a survey is continued by asking it again and answering from stored rows.
    """

    @property
    def n_points(self) -> int | None:
        """Number of points in all, None where it is not known beforehand."""
        ...

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns that its rows have besides those of the evaluation."""
        ...

    @property
    def slices(self) -> tuple[str, ...]:
        """The design variables for each combination of whose values an optimum is stored."""
        ...

    @property
    def baseline(self) -> Mapping[str, float]:
        """Values of design variables; the best of the points that have them is what others are compared with."""
        ...

    @property
    def finished(self) -> bool:
        """Whether every block has been told."""
        ...

    def ask(self) -> list[Block]:
        """Return further blocks that may run now; none when waiting for rows, or finished."""
        ...

    def tell(self, number: int, rows: Rows) -> None:
        """Hand back the rows of block `number`."""
        ...
