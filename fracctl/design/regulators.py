"""The gains of many linear-quadratic regulators at once."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.plants.linear import LinearPlant


def regulators(plant: LinearPlant, q: Floats, r: Floats) -> Floats:
    """Return the gains [K_P K_D], (b, m, 2m), of regulators with diagonal weights; see `fracctl.design.lqr`.

    The solution of the Riccati equation is P = X₂ X₁⁻¹, where the columns of [X₁; X₂] span the stable invariant
    subspace of the Hamiltonian [[A, -B R⁻¹ Bᵀ], [-Q, -Aᵀ]] (Potter, SIAM J. Appl. Math. 14 (1966) 496).

    Args:
        plant: ξ'' = S ξ + D ξ' + υ with m positions.
        q: diagonals of Q ≥ 0, (b, 2m).
        r: diagonals of R > 0, (b, m).

    Raises:
        ArgumentError: no gains stabilise the plant at a finite cost with some of the weights.
    """
    m, count = plant.n_controls, len(q)
    n = 2 * m
    a = np.block([[np.zeros((m, m)), np.eye(m)], [plant.stiffness, plant.damping]])
    hamiltonian = np.zeros((count, 2 * n, 2 * n))
    hamiltonian[:, :n, :n], hamiltonian[:, n:, n:] = a, -a.T
    places = np.arange(m)
    hamiltonian[:, m + places, n + m + places] = -1.0 / r
    hamiltonian[:, n + np.arange(n), np.arange(n)] = -q
    values, vectors = np.linalg.eig(hamiltonian)
    order = np.argsort(values.real, axis=1)
    if np.any(np.take_along_axis(values.real, order, axis=1)[:, n - 1] >= 0.0):
        raise ArgumentError("q", "of a batch", "must weigh every motion that does not die out by itself")
    stable = np.take_along_axis(vectors, order[:, None, :n], axis=2)
    upper, lower = stable[:, :n], stable[:, n:]
    solution = np.linalg.solve(upper.transpose(0, 2, 1), lower.transpose(0, 2, 1)).transpose(0, 2, 1).real
    gains: Floats = solution[:, m:] / r[:, :, None]
    return gains
