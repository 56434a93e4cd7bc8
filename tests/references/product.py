"""From reference loops to the package's objects: the only place where the two meet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fracctl.controllers import PDAlpha
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from fracctl.solvers import Contour
from fracctl.trajectory import Trajectory
from tests.references.loops import Floats, Loop


def closed_loop(members: Sequence[Loop]) -> ClosedLoop:
    """Return the batch of these Hill-Clohessy-Wiltshire loops (all in-plane or all out-of-plane)."""
    k_p, k_d, alpha = (np.array([getattr(member, name) for member in members]) for name in ("k_p", "k_d", "alpha"))
    if members[0].size == 1:
        return ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p[:, 0, 0], k_d[:, 0, 0], alpha[:, 0]))
    return ClosedLoop(HCWInPlane(), PDAlpha(k_p, k_d, alpha))


def solve(members: Sequence[Loop], horizon: float, tolerance: float = 1e-8) -> Trajectory:
    """Return the contour solver's trajectories of a batch."""
    states = np.array([member.start for member in members])
    return Contour(tolerance).solve(closed_loop(members), states, horizon)


def check_times(horizon: float, seed: int = 0) -> Floats:
    """Return times that no grid has: graded towards 0, scattered up to the horizon."""
    scattered = np.random.default_rng(seed).uniform(0.25, horizon, 24)
    return np.sort(np.concatenate([np.geomspace(2e-6, 0.1, 5), scattered, [horizon]]))
