"""What a survey is: it asks for blocks of design points and is told their rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from fracctl.arrays import Array, Floats

Rows = Mapping[str, Array]
"""Rows of a table: arrays of one length by column name."""


@dataclass(frozen=True)
class Block:
    """Design points that are evaluated together, always as a whole."""

    number: int
    """Counts the survey's blocks from 0; also the name of the stored part."""
    first_point: int
    """Number of the first of its points in the survey; the others follow it."""
    design: Mapping[str, Floats]
    """Every design variable by name, (b,)."""

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
    def slice(self) -> str | None:
        """The design variable for each value of which an optimum is stored."""
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
