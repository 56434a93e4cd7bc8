"""What measures of tethers share: the plant, and what its length is led to."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import UnsupportedError
from fracctl.meshwise import MeshTrajectory

if TYPE_CHECKING:
    from fracctl.plants.tether import Tether


def tether_of(trajectory: MeshTrajectory, name: str) -> Tether:
    """Return the tether that a trajectory is of.

    Raises:
        UnsupportedError: the plant is another.
    """
    from fracctl.plants.tether import Tether  # loads its kernels

    plant: object = trajectory.plant
    if not isinstance(plant, Tether):
        raise UnsupportedError(f"{name} is a measure of tethers, not of {type(plant).__name__}")
    return plant


_FAR = 1e3


def targets(trajectory: MeshTrajectory) -> Floats:
    """Return where q_d goes in the end, (b, m): its value a thousand horizons after the start."""
    batch, _, m = trajectory.demands.shape
    wanted, _ = trajectory.law.reference(_FAR * trajectory.times[-1:])
    return np.array(np.broadcast_to(wanted[..., 0, :], (batch, m)))


def travel(trajectory: MeshTrajectory) -> tuple[Floats, Floats]:
    """Return the target of the first position and the way there from its start, with its sign, (b,) each."""
    target = targets(trajectory)[:, 0]
    return target, target - trajectory.on_mesh[:, 0, 0]
