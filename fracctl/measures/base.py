"""What every measure offers."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from fracctl.arrays import Floats
from fracctl.stepwise import StepwiseTrajectory
from fracctl.trajectory import Trajectory


@runtime_checkable
class Measure(Protocol):
    """A named function of trajectories."""

    name: str
    columns: tuple[str, ...]

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return each column as (b,)."""
        ...


@runtime_checkable
class StepwiseMeasure(Protocol):
    """A named function of trajectories of the method of steps."""

    name: str
    columns: tuple[str, ...]

    def __call__(self, trajectory: StepwiseTrajectory) -> dict[str, Floats]:
        """Return each column as (b,)."""
        ...


def is_stepwise(kind: Any) -> bool | None:
    """Whether a class of measures takes trajectories of the method of steps or of other solvers, by its annotations.

    None where it does not say.
    """
    hint = next(iter(getattr(kind.__call__, "__annotations__", {}).values()), None)
    return {"StepwiseTrajectory": True, "Trajectory": False}.get(getattr(hint, "__name__", str(hint)))
