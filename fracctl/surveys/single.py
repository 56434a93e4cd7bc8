"""One design point."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fracctl.surveys.base import Block, Rows


class Single:
    """The survey of one point.

    Args:
        point: value of every design variable.
    """

    n_points = 1
    columns: tuple[str, ...] = ()
    slices: tuple[str, ...] = ()

    def __init__(self, point: Mapping[str, float]) -> None:
        self.baseline: Mapping[str, float] = {}
        self.finished = False
        self._blocks = [Block(0, 0, {name: np.array([value], dtype=np.float64) for name, value in point.items()})]

    def ask(self) -> list[Block]:
        """Return the one block, once."""
        blocks, self._blocks = self._blocks, []
        return blocks

    def tell(self, number: int, rows: Rows) -> None:  # noqa: ARG002 - nothing depends on the rows
        """Finish."""
        self.finished = True
