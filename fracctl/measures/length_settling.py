"""Settling of a tether's length into bands about its target."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.measures.base import OfTrajectories
from fracctl.measures.mesh_cubics import cubics
from fracctl.measures.tethers import tether_of, travel
from fracctl.meshwise import MeshTrajectory


class LengthSettling(OfTrajectories):
    """When the length of a tether enters bands about its target for good.

    A band of p percent is |λ - λ_d| ≤ p/100 · span, where λ_d is what the reference goes to in the end and the span
    the way |λ_d - λ(0)| there; for station-keeping, which starts at the target, the target itself. The last crossing
    on the cubics between the times of the mesh, as f/2π (``orbits``) and as time over the orbital period, t/T
    (``periods``), which differ on an ellipse. +inf where the length is outside at the horizon, or the member ended
    before.

    Args:
        bands: in percent of the span, one or more.

    Raises:
        ArgumentError: there is no band, or one is not positive.
    """

    name = "length_settling"

    def __init__(self, bands: Sequence[float] = (2.0, 5.0)) -> None:
        self.bands = tuple(float(band) for band in bands)
        if not self.bands or not all(0.0 < band < np.inf for band in self.bands):
            raise ArgumentError("bands", list(bands), "must hold one or more positive numbers, in percent")
        names = [f"settling_{band:g}_percent".replace(".", "_") for band in self.bands]
        self.columns = tuple(f"{name}_{unit}" for unit in ("orbits", "periods") for name in names)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return columns ``settling_2_percent_orbits``, … and ``settling_2_percent_periods``, …, (b,) each.

        Raises:
            UnsupportedError: the plant is no tether.
        """
        plant = tether_of(trajectory, self.name)
        target, way = travel(trajectory)
        span = np.where(way == 0.0, np.abs(target), np.abs(way))
        distance = cubics(trajectory, 0, target)
        settled = [distance.last_crossing(span * band / 100.0) for band in self.bands]
        finite = [np.where(np.isfinite(f), f, 0.0) for f in settled]
        periods = [np.where(np.isfinite(f), plant.orbits(g), np.inf) for f, g in zip(settled, finite, strict=True)]
        return dict(zip(self.columns, [*(f / (2.0 * np.pi) for f in settled), *periods], strict=True))


def length_settling(trajectory: MeshTrajectory, percent: float = 2.0) -> Floats | float:
    """Return the settling of the length as f/2π, (b,), or a number for a single trajectory; see `LengthSettling`."""
    measure = LengthSettling([percent])
    value = measure(trajectory)[measure.columns[0]]
    return value if trajectory.batched else float(value[0])
