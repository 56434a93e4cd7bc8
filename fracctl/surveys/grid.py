"""The product of axes, in blocks that the grid alone decides."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.surveys.base import Block, Rows

LARGEST_BLOCK = 16_384
"""Points in a block: a third of a second's work at 50 000 points a second, a few megabytes of rows."""
SMALLEST_BLOCK = 256
"""Fewer points are not worth a block of their own."""
FEWEST_BLOCKS = 16
"""Grids are cut into about as many blocks at least, that every worker gets some."""

_ASKED_AT_ONCE = 8


class Grid:
    """All combinations of the axes' values.

    Points are numbered with the slice's variable outermost and the last axis innermost, so every slice is contiguous.
    A block holds whole slices, or an equal piece of one.

    Args:
        axes: values by design variable, (k,).
        slice: the design variable for each value of which an optimum is stored.
        baseline: values of design variables that what is compared with has.
        fixed: values of the design variables that have no axis.

    Raises:
        ArgumentError: `slice` names a variable without an axis, `baseline` an unknown one; an axis is empty, or
            also fixed.
    """

    columns: tuple[str, ...] = ()

    def __init__(
        self,
        axes: Mapping[str, Floats],
        slice: str | None = None,  # noqa: A002 - the name in the configuration
        baseline: Mapping[str, float] | None = None,
        fixed: Mapping[str, float] | None = None,
    ) -> None:
        self.slices = () if slice is None else (slice,)
        self.baseline: Mapping[str, float] = dict(baseline or {})
        self._fixed = dict(fixed or {})
        self._check(axes)
        names = [*self.slices, *(name for name in axes if name not in self.slices)]
        self._axes = {name: np.asarray(axes[name], dtype=np.float64) for name in names}
        self._shape = tuple(values.size for values in self._axes.values())
        self._ends = _block_ends(self.n_points, self._shape[0] if self.slices else 1)
        self._asked = 0
        self._told: set[int] = set()

    def _check(self, axes: Mapping[str, Floats]) -> None:
        known = ", ".join([*axes, *self._fixed])
        for name in self.slices:
            if name not in axes:
                raise ArgumentError("slice", repr(name), f"must be one of the axes ({', '.join(axes)})")
        for name in self.baseline:
            if name not in axes and name not in self._fixed:
                raise ArgumentError("baseline", repr(name), f"must name design variables ({known})")
        for name in axes:
            if name in self._fixed:
                raise ArgumentError("fixed", repr(name), "must not name an axis")
        if not axes or any(np.size(values) == 0 for values in axes.values()):
            raise ArgumentError("axes", repr(dict(axes)), "must hold at least one axis, each with at least one value")

    @property
    def n_points(self) -> int:
        """Product of the axes' lengths."""
        return math.prod(self._shape)

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return len(self._ends)

    @property
    def finished(self) -> bool:
        """Whether every block has been told."""
        return len(self._told) == self.n_blocks

    def ask(self) -> list[Block]:
        """Return the next few blocks; their points are made here, not before."""
        numbers = range(self._asked, min(self._asked + _ASKED_AT_ONCE, self.n_blocks))
        self._asked = numbers.stop
        return [self._block(number) for number in numbers]

    def tell(self, number: int, rows: Rows) -> None:  # noqa: ARG002 - a grid does not depend on the rows
        """Note that a block is done."""
        self._told.add(number)

    def _block(self, number: int) -> Block:
        first, end = (self._ends[number - 1] if number else 0), self._ends[number]
        places = np.unravel_index(np.arange(first, end), self._shape)
        varied = {name: values[place] for (name, values), place in zip(self._axes.items(), places, strict=True)}
        constant = {name: np.full(end - first, value) for name, value in self._fixed.items()}
        return Block(number, first, varied | constant)


def _block_ends(n_points: int, n_slices: int) -> list[int]:
    """End of every block: small slices are joined, large or few ones cut into equal pieces."""
    size = n_points // n_slices
    if size < SMALLEST_BLOCK and n_slices > 1:
        joined = min(SMALLEST_BLOCK // size, max(1, n_slices // FEWEST_BLOCKS))
        return [min(end, n_slices) * size for end in range(joined, n_slices + joined, joined)]
    wanted = min(-(-FEWEST_BLOCKS // n_slices), size // SMALLEST_BLOCK)
    pieces = max(1, wanted, -(-size // LARGEST_BLOCK))
    return [slice_ * size + piece * size // pieces for slice_ in range(n_slices) for piece in range(1, pieces + 1)]
