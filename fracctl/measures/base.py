"""What every measure offers."""

from __future__ import annotations

from collections.abc import Iterator
from functools import wraps
from importlib import import_module
from typing import Any, Protocol, runtime_checkable

from fracctl.arrays import Floats
from fracctl.errors import UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.meshwise import MeshTrajectory
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


@runtime_checkable
class MeshMeasure(Protocol):
    """A named function of trajectories on a mesh, of laws with a memory in the loop."""

    name: str
    columns: tuple[str, ...]

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return each column as (b,)."""
        ...


@runtime_checkable
class LoopMeasure(Protocol):
    """A named function of loops, wherever they start; `most_controls` says how many controls they may have, if few."""

    name: str
    columns: tuple[str, ...]

    def of_loop(self, loop: ClosedLoop) -> dict[str, Floats]:
        """Return each column as (b,)."""
        ...


FLOQUET = "floquet_multiplier"
"""Column of a loop measure that decides on stability where coefficients are periodic."""
TRAJECTORIES = {
    "Trajectory": "linear fractional loops",
    "StepwiseTrajectory": "the method of steps",
    "MeshTrajectory": "laws with a memory in the loop",
}
"""Class of the trajectories that a measure takes, and what they are called."""


def trajectories_of(kind: Any) -> str | None:
    """Return the class of trajectories that a class of measures takes, by its annotations; None if it does not say.

    Measures of loops go with the trajectories of linear ones.
    """
    if hasattr(kind, "of_loop"):
        return "Trajectory"
    hint = next(iter(getattr(kind.__call__, "__annotations__", {}).values()), None)
    name = getattr(hint, "__name__", str(hint))
    return name if name in TRAJECTORIES else None


def check_kind(name: str, wanted: str | None, trajectory: object) -> None:
    """Raise UnsupportedError, with what measures the trajectory instead, where a measure is made for another kind."""
    given = type(trajectory).__name__
    if wanted not in (None, given) and given in TRAJECTORIES:
        meant = f"trajectories of {TRAJECTORIES[str(wanted)]}, not of {TRAJECTORIES[given]}"
        raise UnsupportedError(f"{name} is made for {meant}; for these there are {', '.join(_measures_of(given))}")


def _measures_of(trajectories: str) -> Iterator[str]:
    measures = import_module(__package__)  # the room itself, which lists what stands in it
    for name in measures.__all__:
        found = getattr(measures, name)
        if isinstance(found, type) and issubclass(found, OfTrajectories) and trajectories_of(found) == trajectories:
            yield name


class OfTrajectories:
    """A measure that refuses, in a sentence, trajectories of another class than its call is annotated with."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "__call__" not in cls.__dict__:
            return
        call, wanted = cls.__call__, trajectories_of(cls)

        @wraps(call)
        def checked(self: Any, trajectory: Any) -> dict[str, Floats]:
            check_kind(cls.__name__, wanted, trajectory)
            found: dict[str, Floats] = call(self, trajectory)
            return found

        cls.__call__ = checked  # type: ignore[method-assign]
