"""What a plant in state form, x' = f(t, x, u), tells a closed loop and a solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fracctl.arrays import Floats
from fracctl.units import Scales


@dataclass(frozen=True)
class Event:
    """Something that happens where a function of time and state falls through zero."""

    name: str
    """Key under which the time is recorded, e.g. ``collision``; where terminal also the status of the run."""
    function: Callable[[Floats, Floats], Floats]
    """g(t, x) of t (k,) and x (k, n), (k,); it happens where g becomes negative."""
    terminal: bool = True
    """Whether the run ends there."""
    meaning: str = ""
    """What it means, for a sentence in the summary of runs that it ended; empty where the name says it."""


@dataclass(frozen=True)
class Section:
    """A surface that orbits return to: where one function of time and state is zero and another positive."""

    function: Callable[[Floats, Floats], Floats]
    """g(t, x) of t (k,) and x (k, n), (k,), zero on the surface."""
    side: Callable[[Floats, Floats], Floats]
    """A function as g that is positive on the part of it that counts."""


@runtime_checkable
class StatePlant(Protocol):
    """A plant x' = f(t, x, u) with n states and m controls, for whole batches."""

    scales: Scales | None

    @property
    def n_states(self) -> int:
        """Number n of states."""
        ...

    @property
    def n_controls(self) -> int:
        """Number m of controls."""
        ...

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the n states."""
        ...

    @property
    def events(self) -> tuple[Event, ...]:
        """What ends a run, or is recorded in it."""
        ...

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return f of t (b,), x (b, n) and u (b, m), (b, n)."""
        ...

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, n, n), and ∂f/∂u, (b, n, m)."""
        ...


class SecondOrder:
    """The names of plants ξ'' = g(t, ξ, ξ') + υ, whose states are [ξ, ξ']."""

    components: tuple[str, ...]
    """Names of the m positions."""
    angles: tuple[str, ...] = ()
    """Names of positions that are angles in radians."""
    period: float | None = None
    """Of the plant's dependence on time or of its leader's orbit; None where there is none."""

    @property
    def n_states(self) -> int:
        """Number n = 2m of states."""
        return 2 * len(self.components)

    @property
    def n_controls(self) -> int:
        """Number m of positions and of controls."""
        return len(self.components)

    @property
    def state_names(self) -> tuple[str, ...]:
        """The positions, then their rates with the suffix ``_dot``."""
        return self.components + tuple(f"{name}_dot" for name in self.components)

    @property
    def events(self) -> tuple[Event, ...]:
        """Nothing ends a run."""
        return ()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self.components)})"
