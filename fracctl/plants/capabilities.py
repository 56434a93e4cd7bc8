"""What a plant may offer beyond `StatePlant`, each a protocol of its own that `isinstance` asks for."""

from __future__ import annotations

from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.elements import Elements
from fracctl.errors import ArgumentError
from fracctl.plants.hcw import Chief
from fracctl.plants.state import Event, Section, StatePlant


@runtime_checkable
class PeriodicPlant(Protocol):
    """A plant with a period: of its dependence on time, or of its leader's orbit."""

    @property
    def period(self) -> float | None:
        """T > 0, None where this one has none."""
        ...


@runtime_checkable
class LinearPeriodicPlant(PeriodicPlant, Protocol):
    """A plant with a period that is linear in states and controls, though not by constant matrices."""

    linear: Literal[True]
    """That it is."""


@runtime_checkable
class SectionedPlant(Protocol):
    """A plant whose orbits return to a surface."""

    @property
    def section(self) -> Section:
        """The surface."""
        ...


@runtime_checkable
class CompiledPlant(Protocol):
    """A plant ξ'' = g(t, ξ, ξ', υ) that compiled solvers call."""

    @property
    def acceleration(self) -> Any:
        """g, compiled by `fracctl.compiling.pointer_with(ACCELERATION)`."""
        ...

    def kernel_parameters(self, batch: int) -> Floats:
        """Return what g is computed from, (b, k)."""
        ...


@runtime_checkable
class LimitedPlant(Protocol):
    """A plant with limits of its controls, which hold in every loop that is not given others."""

    limits: Floats
    """Of the m controls, by axis, (1, m)."""


@runtime_checkable
class ConstrainedPlant(Protocol):
    """A plant whose equations hold for some controls only: a tether pulls, and does not push."""

    @property
    def control_events(self) -> tuple[Event, ...]:
        """What ends a run, or is recorded in it, with functions g(t, u) of the control instead of the state."""
        ...


@runtime_checkable
class TensionedPlant(Protocol):
    """A plant with a tether whose tension is ρ - u₁."""

    rho: float
    """ρ."""


@runtime_checkable
class DispersedPlant(Protocol):
    """A plant with numbers that may be uncertain."""

    dispersed: tuple[str, ...]
    """Their names."""

    def dispersed_by(self, **numbers: Any) -> Any:
        """Return the plant for numbers of b members, (b,) each."""
        ...


@runtime_checkable
class OrbitalPlant(Protocol):
    """A plant of motion relative to a chief, or leader, on an orbit."""

    @property
    def chief_elements(self) -> Elements:
        """Those of the chief at time 0."""
        ...


@runtime_checkable
class ChiefPlant(Protocol):
    """A plant whose chief is on a circular orbit."""

    chief: Chief
    """The orbit."""


@runtime_checkable
class TurningPlant(Protocol):
    """A plant whose frame turns otherwise than that of a Kepler orbit."""

    @property
    def frame_rate(self) -> Floats:
        """Angular velocity of the frame at time 0, (3,)."""
        ...


@runtime_checkable
class AngularPlant(Protocol):
    """A plant of which some positions are angles."""

    angles: tuple[str, ...]
    """Their names; they are in radians."""


@runtime_checkable
class BatchedPlant(Protocol):
    """A plant that may be another for each member; `rates` and `jacobians` then take one row a member, in order."""

    @property
    def batch(self) -> int | None:
        """Batch size b, None where all members share the plant."""
        ...

    def take(self, rows: Array) -> StatePlant:
        """Return the plant of some members; a member may be asked for more than once."""
        ...


def period_of(plant: object) -> float | None:
    """Return the period of a plant, None where it has none."""
    period = plant.period if isinstance(plant, PeriodicPlant) else None
    return None if period is None else float(period)


def control_events(plant: object) -> tuple[Event, ...]:
    """Return the events of the control that a plant has."""
    return plant.control_events if isinstance(plant, ConstrainedPlant) else ()


def names_dispersed(plant: object) -> tuple[str, ...]:
    """Return the names of a plant's numbers that may be uncertain."""
    return plant.dispersed if isinstance(plant, DispersedPlant) else ()


def batch_of(plant: object) -> int | None:
    """Return the batch size of a plant, None where all members share it."""
    return plant.batch if isinstance(plant, BatchedPlant) else None


def members_of(plant: StatePlant, rows: Array) -> StatePlant:
    """Return the plant of some members."""
    return plant.take(rows) if isinstance(plant, BatchedPlant) and plant.batch is not None else plant


def of_rows(numbers: Floats, rows: int) -> Floats:
    """Return the numbers of members, (1, …) or (b, …), one for each row of states.

    Raises:
        ArgumentError: the rows are not those of the members.
    """
    if len(numbers) not in (1, rows):
        allowed = f"must have a row for each member of the plant, {len(numbers)}"
        raise ArgumentError("x", f"a batch of {rows}", allowed)
    return numbers if len(numbers) == rows else np.repeat(numbers, rows, axis=0)
