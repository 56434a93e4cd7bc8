"""Trajectories of implicit methods: values on a mesh that all members of a batch share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Booleans, Floats
from fracctl.controllers.memory import MemoryLaw
from fracctl.plants.state import StatePlant
from fracctl.trajectory import AnyTrajectory


@dataclass(frozen=True)
class MeshTrajectory(AnyTrajectory):
    """Trajectories of a batch of b loops with m positions on the T times of a mesh."""

    plant: StatePlant
    law: MemoryLaw
    times: Floats
    """Of the mesh, (T,)."""
    on_mesh: Floats
    """[q, q'] at these, (b, T, 2m)."""
    demands: Floats
    """What the law asks for at these, (b, T, m)."""
    memory: Floats
    """D^ν Δq at these, (b, T, m)."""
    auxiliary: Floats
    """The law's auxiliary states at these, (b, T, p)."""
    limits: Floats
    """Lower and upper limits of the controls, (b, 2, m)."""
    end: Floats
    events: Mapping[str, Floats]
    status: Array
    """A word each, (b,): ``ok``, the name of a terminal event, ``diverged`` (not finite) or ``failed`` (an equation
    was not solved, or the error is above the tolerance)."""
    error_estimate: Floats
    """Largest difference of a position from that on a mesh with half the steps, relative to its peak, (b,); infinite
    where that run did not last as long."""
    memory_error: Floats
    """Bound on the relative error of the kernel of the memory, (b,)."""
    counters: Mapping[str, Array]
    """``steps``, their Newton ``iterations``, steps that were ``bracketed`` and ``unresolved``, each (b,)."""
    batched: bool = True

    @property
    def horizon(self) -> float:
        """The last time of the mesh."""
        return float(self.times[-1])

    @property
    def controls_on_mesh(self) -> Floats:
        """Controls at the times of the mesh, (b, T, m)."""
        return np.clip(self.demands, self.limits[:, :1], self.limits[:, 1:])

    @property
    def alive(self) -> Booleans:
        """Which times of the mesh lie before a member's end, (b, T)."""
        return self.times <= self.end[:, None]

    def __call__(self, times: ArrayLike) -> Floats:
        """Return the states at times (t,), (b, t, 2m), or (t, 2m) for a single loop.

        Positions are cubics with their rates, rates are straight lines between the times of the mesh.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = self._checked(times)[0]
        return self._shown(t, self._at(t))

    def control(self, times: ArrayLike) -> Floats:
        """Return the controls at times (t,), (b, t, m), or (t, m) for a single loop.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = self._checked(times)[0]
        return self._shown(t, np.clip(self._lines(self.demands, t), self.limits[:, :1], self.limits[:, 1:]))

    def demand(self, times: ArrayLike) -> Floats:
        """Return what the control would be without limits, as `control` returns the control.

        Raises:
            ArgumentError: a time lies outside [0, horizon].
        """
        t = self._checked(times)[0]
        return self._shown(t, self._lines(self.demands, t))

    def _at(self, t: Floats) -> Floats:
        m = self.on_mesh.shape[2] // 2
        place = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        h = (self.times[place + 1] - self.times[place])[:, None]
        y = (t - self.times[place])[:, None] / h
        start, end = self.on_mesh[:, place], self.on_mesh[:, place + 1]
        gap, first, last = end[..., :m] - start[..., :m], h * start[..., m:], h * end[..., m:]
        positions = start[..., :m] + y * (first + y * (3.0 * gap - 2.0 * first - last + y * (first + last - 2.0 * gap)))
        return np.concatenate([positions, start[..., m:] + y * (end[..., m:] - start[..., m:])], axis=2)

    def _lines(self, values: Floats, t: Floats) -> Floats:
        place = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        y = ((t - self.times[place]) / (self.times[place + 1] - self.times[place]))[:, None]
        lines: Floats = values[:, place] + y * (values[:, place + 1] - values[:, place])
        return lines
