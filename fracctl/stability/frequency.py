"""The frequency response of a linear loop with memory: (iω)^α is a number, so nothing is approximated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.fractional.terms import FractionalTerm, turned
from fracctl.loop import ClosedLoop
from fracctl.plants.linear import LinearPlant

NEXT_TO_ZERO = 1e-150
"""The frequency that stands for 0: a constant term of a law has its limit there, an integral is beyond all bounds."""
_LOWEST, _HIGHEST, _PER_DECADE = 1e-9, 1e3, 24
"""Ends of the grid, over the least and the largest pole radius, and its density."""
_NEAR_RESONANCES = np.concatenate([[0.0], *(side * 10.0 ** np.arange(-12.0, -1.0, 0.5) for side in (-1.0, 1.0))])
"""Relative distances from a resonance of the plant, where the loop gain may exceed 1 in a narrow band only."""


class FrequencyResponse:
    """Controller and plant of a loop at σ = iω.

        υ = -C(σ) ξ,        M(σ) ξ = (σ² I - σ D - S) ξ = υ,        L = C M⁻¹

    L is the loop gain where the control enters the plant, with negative feedback. Auxiliary states z of the law, with
    0 = A_z z + A_ξ ξ, are eliminated. Sensitivities are written with (M + C)⁻¹, which is finite at the poles of the
    plant. A saturation plays no part.

    Args:
        loop: of a linear plant and a linear law, single or a batch.

    Raises:
        UnsupportedError: the loop is not linear, or has delays.
    """

    ends: tuple[float, ...] = (NEXT_TO_ZERO,)

    def __init__(self, loop: ClosedLoop) -> None:
        self.system = loop.system
        assert isinstance(loop.plant, LinearPlant)
        self._stiffness, self._damping = loop.plant.stiffness, loop.plant.damping
        self.controls = self.system.n_positions
        self.batch = self.system.batch or 1
        self.matrix = CharacteristicMatrix(self.system)
        m = self.controls
        self._auxiliary = [FractionalTerm(t.matrix[..., m:, :], t.orders) for t in self.system.dynamics]

    def __call__(self, omega: Floats, rows: Array) -> tuple[Complexes, Complexes]:
        """Return C and M of the members `rows` (n,) at frequencies ω > 0, (1, k) shared or (n, k), as (n, k, m, m)."""
        m, identity = self.controls, np.eye(self.controls)
        control = -_sum(self.system.control, omega, rows)
        if self.system.n_auxiliary:
            states = _sum(self._auxiliary, omega, rows)
            feedback = control[..., m:] @ np.linalg.solve(states[..., m:], states[..., :m])
            control = control[..., :m] - feedback
        frequency = omega[..., None, None]
        plant = -(frequency**2) * identity - self._stiffness - 1j * frequency * self._damping
        shape = (rows.size, omega.shape[1], m, m)
        return np.broadcast_to(control, shape), np.broadcast_to(plant, shape)

    @property
    def resonances(self) -> Floats:
        """|Im| of the plant's poles, those that are 0 left out."""
        m = self.controls
        matrix = np.block([[np.zeros((m, m)), np.eye(m)], [self._stiffness, self._damping]])
        poles = np.linalg.eigvals(matrix)
        heights = poles.imag[poles.imag > 1e-6 * np.abs(poles).max(initial=0.0)]
        # eigenvalues are exact to rounding only, and the poles of HCW lie at ±i
        return np.unique(np.round(heights, 12))

    def grid(self) -> Floats:
        """Return frequencies (k,) for all members: logarithmic, and close around the plant's resonances.

        C and M are sums and quotients of powers, which bend over a decade unless they have zeros near the axis. Those
        of M are known; the grid comes as near to them as numbers do. Its ends are 9 decades below and 3 above all
        zeros of det(M + C).
        """
        radius = pole_radius(self.matrix)
        low, high = np.log10(_LOWEST * min(1.0, float(radius.min()))), np.log10(_HIGHEST * float(radius.max()))
        even = np.logspace(low, high, 1 + int(_PER_DECADE * (high - low)))
        near = (self.resonances[:, None] * (1.0 + _NEAR_RESONANCES)).ravel()
        return np.unique(np.concatenate([even, near]))


def over(numerator: Complexes, denominator: Complexes) -> Complexes:
    """Return A B⁻¹ of matrices (…, m, m); in closed form for m ≤ 2, which is most of the work of a survey."""
    size = denominator.shape[-1]
    if size == 1:
        return numerator / denominator
    if size > 2:
        return numerator @ np.linalg.inv(denominator)
    a, b, c, d = (denominator[..., i, j] for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)))
    adjugate = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return numerator @ (adjugate / (a * d - b * c)[..., None, None])


def _sum(terms: Sequence[FractionalTerm], omega: Floats, rows: Array) -> Complexes:
    """Return Σ G (iω)^β, (n or 1, k, r, p)."""
    total: Complexes = np.zeros((1, 1, 1, 1), dtype=np.complex128)
    for term in terms:
        part = term.take(rows)
        matrix = part.matrix if part.matrix.ndim == 3 else part.matrix[None]
        if not matrix.any():
            total = total + np.zeros((1, *matrix.shape[-2:]))
            continue
        orders = part.orders if part.orders.ndim == 2 else part.orders[None]
        values = np.exp(orders[:, None, :] * np.log(omega)[..., None]) * turned(orders)[:, None, :]
        total = total + matrix[:, None] * values[..., None, :]
    return total
