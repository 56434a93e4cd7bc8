"""Linear second-order plants ξ'' = S ξ + D ξ' + υ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite
from fracctl.errors import ArgumentError
from fracctl.plants.state import SecondOrder
from fracctl.units import Scales


class LinearPlant(SecondOrder):
    """A linear plant with one control acceleration for each position.

        ξ'' = S ξ + D ξ' + υ

    Args:
        stiffness: S, (m, m), or a number for m = 1; 1/time².
        damping: D, (m, m), or a number for m = 1; 1/time. Default: none.
        components: names of the m positions; default x1 … xm (x for m = 1).
        scales: SI value of the units of length and time; None for a dimensionless plant.

    Raises:
        ArgumentError: a matrix is not finite or not square, or the sizes differ.
    """

    def __init__(
        self,
        stiffness: ArrayLike,
        damping: ArrayLike = 0.0,
        components: Sequence[str] | None = None,
        scales: Scales | None = None,
    ) -> None:
        self.stiffness = _square("stiffness", stiffness)
        size = self.stiffness.shape[0]
        given = finite("damping", damping)
        self.damping = np.zeros((size, size)) if given.ndim == 0 and given == 0.0 else _square("damping", given)
        if self.damping.shape != self.stiffness.shape:
            allowed = f"must have the shape of `stiffness`, {self.stiffness.shape}"
            raise ArgumentError("damping", f"of shape {self.damping.shape}", allowed)
        default = ("x",) if size == 1 else tuple(f"x{i + 1}" for i in range(size))
        self.components: tuple[str, ...] = default if components is None else tuple(components)
        if len(self.components) != size or len(set(self.components)) != size:
            raise ArgumentError("components", self.components, f"must be {size} different names")
        self.scales = scales

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return x' of x = [ξ, ξ'], (b, 2m)."""
        del t
        m = self.n_controls
        return np.concatenate([x[:, m:], x[:, :m] @ self.stiffness.T + x[:, m:] @ self.damping.T + u], axis=1)

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, 2m, 2m), and ∂f/∂u, (b, 2m, m), which do not depend on t, x and u."""
        del t, u
        m = self.n_controls
        one, none = np.eye(m), np.zeros((m, m))
        state, control = np.block([[none, one], [self.stiffness, self.damping]]), np.concatenate([none, one])
        return np.broadcast_to(state, (len(x), 2 * m, 2 * m)), np.broadcast_to(control, (len(x), 2 * m, m))


def _square(name: str, value: ArrayLike) -> Floats:
    array = finite(name, value)
    if array.ndim == 0:
        array = array.reshape(1, 1)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or array.shape[0] == 0:
        raise ArgumentError(name, f"of shape {array.shape}", "must be a number or a square matrix (m, m)")
    return array
