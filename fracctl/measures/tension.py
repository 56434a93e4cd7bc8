"""Tension of a tether: what it is, what it was to be, and how long it was at a bound."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.base import OfTrajectories
from fracctl.measures.mesh_lines import begin_of, controls, lines
from fracctl.measures.tethers import tether_of
from fracctl.meshwise import MeshTrajectory


class Tension(OfTrajectories):
    """Least and largest tension T̂ = ρ - τ_t up to a member's end.

    ``tension_min`` and ``tension_max`` are over m̄ ḟ² L, those with ``_n`` in newton. ``saturated_percent`` is the
    share of f at which the demand is at a bound or beyond. The tension demanded, ρ - w_t without limits, is looked at
    after a while only: a memory of Riemann and Liouville makes it infinite at the start. ``tension_margin`` is its
    least distance to a bound, negative where it is beyond one; +inf without limits.

    Args:
        after_orbits: f/2π from which on the demanded tension and the margin count.

    Raises:
        ArgumentError: the number is negative.
    """

    name = "tension"
    columns = (
        "tension_min",
        "tension_max",
        "tension_min_n",
        "tension_max_n",
        "demanded_tension_min",
        "demanded_tension_max",
        "tension_margin",
        "saturated_percent",
    )

    def __init__(self, after_orbits: float = 0.25) -> None:
        self.begin = begin_of(after_orbits)

    def __call__(self, trajectory: MeshTrajectory) -> dict[str, Floats]:
        """Return the columns, (b,) each; the demanded ones are infinite where a member ended before.

        Raises:
            UnsupportedError: the plant is no tether.
        """
        plant = tether_of(trajectory, self.name)
        control, demand = controls(trajectory), lines(trajectory, trajectory.demands[..., 0])
        later = lines(trajectory, trajectory.demands[..., 0], self.begin)
        newton = lines(trajectory, plant.tension_n(trajectory.times, trajectory.controls_on_mesh))
        low, high = trajectory.limits[:, 0, 0], trajectory.limits[:, 1, 0]
        values = (
            plant.rho - control.largest()[:, 0],
            plant.rho - control.least()[:, 0],
            newton.least(),
            newton.largest(),
            plant.rho - later.largest(),
            plant.rho - later.least(),
            np.minimum(high - later.largest(), later.least() - low),
            100.0 * demand.share_outside(low, high),
        )
        return dict(zip(self.columns, values, strict=True))
