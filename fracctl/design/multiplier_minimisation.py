"""Constant gains of delayed feedback that make the largest non-trivial multiplier of some orbits least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import OptimizeResult, minimize
from scipy.stats import qmc

from fracctl.arrays import Floats, finite, positive, share
from fracctl.errors import ArgumentError
from fracctl.stability.floquet import FEWEST_NODES, Neighbourhood
from fracctl.stability.periodic_orbits import PeriodicOrbit

_descend: Any = minimize
"""Without its types, which want functions that take any number of arguments."""
_SAMPLES = 16
"""Points of the hypercube for each start."""
_TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
ROTATIONS: Floats = np.stack([np.kron(side, part) for side in np.eye(2)[:, None] for part in (np.eye(2), _TURN)])
"""The basis of K = [aI + bJ | cI + dJ], J = [[0, 1], [-1, 0]], for two positions, (4, 2, 4)."""


@dataclass(frozen=True)
class MinimisedGain:
    """What a search for a gain has found."""

    gain: Floats
    """K = Σ_i c_i B_i, (m, n)."""
    coefficients: Floats
    """c, (k,)."""
    largest: Floats
    """Largest non-trivial |μ| of each orbit, (o,)."""
    evaluations: int
    """Gains that were judged."""


def minimise_largest_multiplier(
    orbits: Sequence[PeriodicOrbit],
    basis: ArrayLike,
    starts: int = 16,
    seed: int = 0,
    reach: float = 0.2,
    evaluations: int = 300,
    recall: float = 0.0,
    nodes: int = FEWEST_NODES,
) -> MinimisedGain:
    """Return the gain K = Σ_i c_i B_i that minimises max |μ| over all orbits and all their non-trivial multipliers.

    From the best of a Latin hypercube the simplex method of Nelder and Mead goes down (the function is not smooth where
    multipliers meet); the best is judged again with 100 nodes. Multipliers 1 of known periodic solutions do not count
    (`fracctl.stability.nontrivial_multipliers`).

    Args:
        orbits: targets, one or more, each with its period as the delay.
        basis: B, (k, m, n), e.g. `ROTATIONS`.
        starts: number of descents; the hypercube has 16 times as many points.
        seed: of the hypercube.
        reach: its coefficients lie in [-reach, reach].
        evaluations: gains that are judged from each start, at most.
        recall: R in [0, 1).
        nodes: Chebyshev nodes in a period while searching.

    Raises:
        ArgumentError: there are no orbits, the basis has a wrong shape, or a number is out of its range.
    """
    if not orbits:
        raise ArgumentError("orbits", "none", "must be one or more")
    directions, shape = finite("basis", basis), (orbits[0].plant.n_controls, orbits[0].plant.n_states)
    if directions.ndim != 3 or directions.shape[1:] != shape:
        raise ArgumentError("basis", f"of shape {directions.shape}", f"must have shape (k, {shape[0]}, {shape[1]})")
    for name, value in (("starts", starts), ("reach", reach), ("evaluations", evaluations)):
        positive(name, value)
    recall, near = share("recall", recall), [Neighbourhood(orbit, nodes) for orbit in orbits]

    def largest(coefficients: Floats, places: Sequence[Neighbourhood]) -> Floats:
        gain = np.tensordot(coefficients, directions, 1)
        return np.array([abs(place.nontrivial(gain, recall)[0]) for place in places])

    def worst(coefficients: Floats) -> float:
        return float(largest(coefficients, near).max())

    samples = qmc.LatinHypercube(len(directions), rng=np.random.default_rng(seed)).random(_SAMPLES * starts)
    points = sorted(reach * (2.0 * samples - 1.0), key=worst)[:starts]
    options: Any = {"maxfev": evaluations, "xatol": 1e-5, "fatol": 1e-6}
    searches: list[OptimizeResult] = [_descend(worst, point, method="Nelder-Mead", options=options) for point in points]
    best = min(searches, key=lambda search: float(search.fun)).x
    final = largest(best, [Neighbourhood(orbit) for orbit in orbits])
    judged = len(samples) + sum(search.nfev for search in searches)
    return MinimisedGain(np.tensordot(best, directions, 1), best, final, judged)
