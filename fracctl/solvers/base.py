"""What every solver offers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fracctl.arrays import Array, Floats
from fracctl.loop import ClosedLoop
from fracctl.trajectory import Trajectory


@dataclass(frozen=True)
class SolvedMembers:
    """Some members of a batch, solved from k initial states on one grid."""

    rows: Array
    """Which r members of the loop's batch, (r,)."""
    trajectory: Trajectory
    """k·r trajectories, the initial state as the slow axis."""


@runtime_checkable
class Solver(Protocol):
    """A way to trajectories of a closed loop."""

    name: str
    tolerance: float
    """Error it is asked to keep, relative to the peaks; 0 where it cannot be asked."""
    cross_check: float
    """Share of a survey's rows that another solver computes too."""
    checked_by: str
    """Name of that solver."""

    def supports(self, loop: ClosedLoop) -> str | None:
        """Return None, or one sentence that says why the loop is refused and what to use instead."""
        ...

    def solve(self, loop: ClosedLoop, initial_state: Floats, horizon: float) -> Trajectory:
        """Return the trajectories of all members on one grid."""
        ...

    def survey(self, loop: ClosedLoop, initial_states: Floats, horizon: float) -> Iterator[SolvedMembers]:
        """Yield groups of members of a large batch, each from all k initial states (k, n), on grids of their own.

        Unstable members need no trajectory; theirs may be NaN.
        """
        ...
