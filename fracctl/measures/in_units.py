"""What measures in SI units share: they are told the plant and the spacecraft before they measure."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.measures.base import OfTrajectories
from fracctl.plants.linear import LinearPlant
from fracctl.plants.state import StatePlant
from fracctl.units import Scales, Spacecraft

Told = TypeVar("Told", bound="InUnits")


class InUnits(OfTrajectories):
    """A measure that needs units; `for_flight` gives them to it."""

    name: str
    plant: LinearPlant | StatePlant | None = None
    spacecraft: Spacecraft = Spacecraft()

    def for_flight(self: Told, plant: LinearPlant | StatePlant, spacecraft: Spacecraft | None = None) -> Told:
        """Return the measure for trajectories of a plant.

        Raises:
            ArgumentError: the plant or the spacecraft lacks what the measure needs.
        """
        told = copy.copy(self)
        told.plant, told.spacecraft = plant, spacecraft or Spacecraft()
        told.check()
        return told

    def check(self) -> None:
        """Raise ArgumentError unless everything is known."""
        if self.plant is not None and self.plant.scales is None:
            raise ArgumentError("plant", self.plant, "needs units (scales) for this measure")

    @property
    def scales(self) -> Scales:
        """The plant's scales.

        Raises:
            ArgumentError: no plant has been given.
        """
        if self.plant is None:
            raise ArgumentError("plant", None, "must be given to a measure in SI units", "call for_flight(plant)")
        assert self.plant.scales is not None
        return self.plant.scales


def checked_bands(thresholds_m: Sequence[float]) -> tuple[float, ...]:
    """Return settling bands in metres; raise ArgumentError unless they are different positive numbers."""
    bands = tuple(float(band) for band in thresholds_m)
    if not bands or len(set(bands)) < len(bands) or not all(math.isfinite(b) and b > 0.0 for b in bands):
        raise ArgumentError("thresholds_m", list(thresholds_m), "must hold different positive numbers")
    return bands


TURN = 2.0 * np.pi
_INTERVALS = 400


def last_orbit(horizon: float) -> tuple[Floats, Floats]:
    """Return times in the last 2π before the horizon, or in all of it if that is shorter, and their weights.

    Of an integral by Gauss's rule with five points on each of 400 intervals, (2000,) each.
    """
    edges = np.linspace(max(horizon - TURN, 0.0), horizon, _INTERVALS + 1)
    half = 0.5 * np.diff(edges)
    points, weights = np.polynomial.legendre.leggauss(5)
    times = (0.5 * (edges[:-1] + edges[1:])[:, None] + half[:, None] * points).ravel()
    return times, np.outer(half, weights).ravel()
