"""The gains of the linear-quadratic regulator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_continuous_are

from fracctl.arrays import Floats, finite
from fracctl.controllers.parameters import entry_names
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.plants.linear import LinearPlant


def lqr(plant: LinearPlant, q: ArrayLike = 1.0, r: ArrayLike = 1.0, round_to: float | None = None) -> Floats:
    """Return the gains [K_P K_D], (m, 2m), that minimise ∫ (xᵀ Q x + υᵀ R υ) ds over υ = -K_P ξ - K_D ξ'.

        K = R⁻¹ Bᵀ P,        Aᵀ P + P A - P B R⁻¹ Bᵀ P + Q = 0

    with x = [ξ, ξ'], x' = A x + B υ (Yaylali, Butcher, Sinclair, Eqs. 8 and 23).

    Args:
        plant: ξ'' = S ξ + D ξ' + υ with m positions.
        q: Q ≥ 0; a number, its diagonal (2m,), or (2m, 2m).
        r: R > 0; a number, its diagonal (m,), or (m, m).
        round_to: gains become multiples of this; None leaves them.

    Raises:
        ArgumentError: a weight has a wrong shape or sign, is not symmetric, or no gains stabilise the plant at a finite
            cost; the step is not positive.
        UnsupportedError: the plant is not linear.
    """
    given: object = plant
    if not isinstance(given, LinearPlant):
        cure = "use `lqr_at`, or controller=delayed_lqr"
        raise UnsupportedError(f"lqr takes linear plants, but {type(plant).__name__} is none; {cure}")
    m = plant.n_controls
    a = np.block([[np.zeros((m, m)), np.eye(m)], [plant.stiffness, plant.damping]])
    b = np.concatenate([np.zeros((m, m)), np.eye(m)])
    gains = regulator(a, b, weight("q", q, 2 * m), weight("r", r, m, definite=True))[0]
    return gains if round_to is None else _rounded(gains, round_to)


def regulator(a: Floats, b: Floats, q: Floats, r: Floats) -> tuple[Floats, Floats]:
    """Return K, (m, n), and P, (n, n), of x' = A x + B u with matrices Q (n, n) and R (m, m).

    Raises:
        ArgumentError: no gains stabilise the plant at a finite cost.
    """
    try:
        solution = np.asarray(solve_continuous_are(a, b, q, r), dtype=np.float64)
        gains = np.asarray(np.linalg.solve(r, b.T @ solution), dtype=np.float64)
        stable = bool(np.linalg.eigvals(a - b @ gains).real.max() < 0.0)
    except np.linalg.LinAlgError:
        stable = False
    if not stable:
        raise ArgumentError("q", _diagonal(q), "must weigh every motion that does not die out by itself")
    return gains, solution


def gains_by_name(components: Sequence[str], gains: Floats) -> dict[str, Floats]:
    """Return the entries of [K_P K_D], (m, 2m) or (b, m, 2m), by the names of a law's parameters, () or (b,)."""
    m = len(components)
    values: dict[str, Floats] = {}
    for prefix, block in (("k_p", gains[..., :m]), ("k_d", gains[..., m:])):
        rows = enumerate(entry_names(prefix, components))
        values |= {name: block[..., i, j] for i, row in rows for j, name in enumerate(row)}
    return values


def weight(name: str, value: ArrayLike, size: int, definite: bool = False) -> Floats:
    """Return a number, a diagonal (size,) or a matrix as a matrix; refuse what is not symmetric or has a wrong sign."""
    array = finite(name, value)
    if array.ndim < 2 and array.shape in ((), (size,)):
        array = np.diag(np.broadcast_to(array, size))
    if array.shape != (size, size):
        allowed = f"must be a number, a diagonal ({size},) or a matrix ({size}, {size})"
        raise ArgumentError(name, f"of shape {array.shape}", allowed)
    lowest = float(np.linalg.eigvalsh(array)[0])
    rounding = 1e-12 * float(np.abs(array).max())
    if not np.array_equal(array, array.T) or lowest < -rounding or (definite and lowest <= rounding):
        raise ArgumentError(name, _diagonal(array), f"must be symmetric and positive {'semi' * (not definite)}definite")
    return array


def _diagonal(weight: Floats) -> str:
    return f"of diagonal {np.diag(weight).tolist()}"


def _rounded(gains: Floats, step: float) -> Floats:
    if not (np.isfinite(step) and step > 0.0):
        raise ArgumentError("round_to", step, "must be a positive number, or null")
    multiples: Floats = np.round(np.round(gains / step) * step, 12) + 0.0
    return multiples
