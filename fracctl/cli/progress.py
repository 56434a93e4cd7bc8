"""How far a run is, on standard error: points done, rate, time left."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fracctl.execution.progress import Progress


_SPEED_OVER_S = 300.0
"""The rate is that of the last so many seconds: blocks of some surveys take a minute."""


def display(label: str, quiet: bool) -> Progress:
    """Return a progress display; a silent one if asked, or if standard error is no terminal."""
    from fracctl.execution.progress import NoProgress

    if quiet or sys.stderr is None or not sys.stderr.isatty():
        return NoProgress()
    return Bar(label)


class Bar:
    """A bar that vanishes at the end.

    Args:
        label: what is running.
    """

    def __init__(self, label: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Rich

        self._rich = Rich(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(compact=True, elapsed_when_finished=True),
            console=Console(stderr=True),
            transient=True,
            speed_estimate_period=_SPEED_OVER_S,
        )
        self._task = self._rich.add_task(label, total=None, rate="")

    def start(self, total_points: int | None) -> None:
        """Show the bar; without a total it only counts."""
        self._rich.update(self._task, total=total_points)
        self._rich.start()

    def advance(self, points: int) -> None:
        """Add points."""
        speed = self._rich.tasks[0].speed
        rate = f"{speed:,.0f} points/s".replace(",", " ") if speed else ""
        self._rich.update(self._task, advance=points, rate=rate)

    def found(self, points: int) -> None:
        """Add points that say nothing of the rate."""
        done = int(self._rich.tasks[0].completed)
        self._rich.reset(self._task, completed=done + points)

    def finish(self) -> None:
        """Remove the bar."""
        self._rich.stop()
