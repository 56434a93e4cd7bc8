"""Blocks in the order of their numbers, whatever the order in which they are done."""

from __future__ import annotations

from collections.abc import Callable

import pyarrow as pa

_HELD = 8
"""Tables that wait in memory; others are read again."""


class InOrder:
    """Hands the tables of blocks on as soon as those of all blocks before are there.

    Args:
        read: returns the stored table of a block.
        take: is handed the tables.
    """

    def __init__(self, read: Callable[[int], pa.Table], take: Callable[[pa.Table], None]) -> None:
        self._read, self._take = read, take
        self._next = 0
        self._waiting: dict[int, pa.Table | None] = {}

    def add(self, number: int, table: pa.Table | None = None) -> None:
        """Add the table of a block; None for one that is to be read."""
        held = sum(one is not None for one in self._waiting.values())
        self._waiting[number] = table if held < _HELD or number == self._next else None
        while self._next in self._waiting:
            self._hand_on(self._next)
            self._next += 1

    def finish(self) -> None:
        """Hand on what is left where numbers are missing."""
        for number in sorted(self._waiting):
            self._hand_on(number)

    def _hand_on(self, number: int) -> None:
        table = self._waiting.pop(number)
        self._take(self._read(number) if table is None else table)
