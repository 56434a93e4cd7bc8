"""How a run tells the outside how far it is."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Told from the parent process only, in its main thread."""

    def start(self, total_points: int | None) -> None:
        """Begin; `total_points` is None where it is not known beforehand."""
        ...

    def advance(self, points: int) -> None:
        """So many further points are stored."""
        ...

    def found(self, points: int) -> None:
        """So many further points were stored before, and cost no time now."""
        ...

    def finish(self) -> None:
        """End, also after a failure or an interruption."""
        ...


class NoProgress:
    """Shows nothing."""

    def start(self, total_points: int | None) -> None:
        """Ignore."""

    def advance(self, points: int) -> None:
        """Ignore."""

    def found(self, points: int) -> None:
        """Ignore."""

    def finish(self) -> None:
        """Ignore."""
