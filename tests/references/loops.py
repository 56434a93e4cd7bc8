"""Closed loops as explicit matrices, and random ones for the tests.

    ξ'' = S ξ + D ξ' + υ,    υ = -K_P ξ - K_D D^α ξ,    ξ(0), ξ'(0) given

D^α is the Caputo derivative from 0 with one order a column. The Hill-Clohessy-Wiltshire matrices are written out
here once more, from Yaylali, Butcher, Sinclair, Eqs. 4-5, so that a flipped sign in the package shows.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

IN_PLANE_STIFFNESS = ((3.0, 0.0), (0.0, 0.0))
IN_PLANE_DAMPING = ((0.0, 2.0), (-2.0, 0.0))
OUT_OF_PLANE_STIFFNESS = ((-1.0,),)
OUT_OF_PLANE_DAMPING = ((0.0,),)

IC1 = {"u": -0.001, "v": 0.0, "w": 0.0, "u_dot": 0.0, "v_dot": 0.002, "w_dot": 0.002}
IC2 = {"u": -0.001, "v": 0.002, "w": -0.001, "u_dot": 0.0, "v_dot": 0.002, "w_dot": 0.0}
IC3 = {"u": 0.001, "v": -0.002, "w": 0.001, "u_dot": 0.0, "v_dot": 0.002, "w_dot": -0.002}
INITIAL_CONDITIONS = {"ic1": IC1, "ic2": IC2, "ic3": IC3}
"""Table 1 of the paper, dimensionless."""


def initial_state(initial_condition: str, components: str) -> Floats:
    """Return [ξ, ξ'] of ic1, ic2 or ic3 for the components `w` or `uv`."""
    table = INITIAL_CONDITIONS[initial_condition]
    return np.array([table[c] for c in components] + [table[f"{c}_dot"] for c in components])


@dataclass(frozen=True)
class Loop:
    """One closed loop with its start; m = 1 or 2 positions."""

    stiffness: Floats
    """S, (m, m)."""
    damping: Floats
    """D, (m, m)."""
    k_p: Floats
    """K_P, (m, m)."""
    k_d: Floats
    """K_D, (m, m)."""
    alpha: Floats
    """α in (0, 1], (m,)."""
    start: Floats
    """[ξ(0), ξ'(0)], (2m,)."""

    @property
    def size(self) -> int:
        """m."""
        return len(self.alpha)

    @property
    def value(self) -> Floats:
        """ξ(0), (m,)."""
        return self.start[: self.size]

    @property
    def rate(self) -> Floats:
        """ξ'(0), (m,)."""
        return self.start[self.size :]

    def replace(self, **changes: ArrayLike) -> Loop:
        """Return the loop with some of its arrays changed."""
        return dataclasses.replace(self, **{name: np.asarray(value, float) for name, value in changes.items()})


def out_of_plane(k_p: float, k_d: float, alpha: float, start: ArrayLike) -> Loop:
    """Return w'' + k_D D^α w + (1 + k_P) w = 0 (Eq. 19)."""
    gain_p, gain_d = np.array([[k_p]]), np.array([[k_d]])
    stiffness, damping = np.array(OUT_OF_PLANE_STIFFNESS), np.array(OUT_OF_PLANE_DAMPING)
    return Loop(stiffness, damping, gain_p, gain_d, np.array([alpha]), np.asarray(start, float))


def in_plane(gains: ArrayLike, alpha: ArrayLike, start: ArrayLike) -> Loop:
    """Return the loop of Eq. 17 for the 2×4 gains [K_P K_D] of Eq. 7."""
    gains = np.asarray(gains, float)
    stiffness, damping = np.array(IN_PLANE_STIFFNESS), np.array(IN_PLANE_DAMPING)
    return Loop(stiffness, damping, gains[:, :2], gains[:, 2:], np.asarray(alpha, float), np.asarray(start, float))


def random_out_of_plane(seed: int, count: int) -> Iterator[Loop]:
    """Yield stable loops (1 + k_P > 0, k_D > 0) with orders in [0.5, 1) and random starts."""
    generator = np.random.default_rng(seed)
    for _ in range(count):
        k_p, k_d, alpha = generator.uniform([-0.6, 0.05, 0.5], [4.0, 4.0, 1.0])
        yield out_of_plane(k_p, k_d, alpha, generator.uniform(-2e-3, 2e-3, 2))


def random_in_plane(seed: int, count: int, spread: float | None = None) -> Iterator[Loop]:
    """Yield loops, stable or not, with different orders in [0.5, 1) and random starts.

    Gains are uniform in [-8, 8], or within `spread` of the rounded LQR gains of the paper (Q = I₄, R = I₂).
    """
    seed_gains = np.array([[4.0, -0.95, 2.4, 0.65], [3.0, 0.3, 0.65, 1.95]])
    generator = np.random.default_rng(seed)
    for _ in range(count):
        if spread is None:
            gains = generator.uniform(-8.0, 8.0, (2, 4))
        else:
            gains = seed_gains + generator.uniform(-spread, spread, (2, 4))
        yield in_plane(gains, generator.uniform(0.5, 1.0, 2), generator.uniform(-2e-3, 2e-3, 4))
