"""Reference trajectories under laws that are sums of actions, to any number of digits: Talbot's inversion by mpmath.

    ξ'' = S ξ + D ξ' + υ,    υ = -Σ_j G_j a_j(ξ),    (σ² - D σ - S) Ξ = σ ξ₀ + ξ₀' - D ξ₀ + Υ

An action a has the transform f Ξ - g ξ₀, one f and g a component: σ^γ and σ^(γ-1) for the Caputo derivative of order
γ in (0, 1], σ^(-γ) and 0 for the integral, σ/(Tσ + 1) and 1/(Tσ + 1) for the derivative behind a lag. The two are one
system of linear equations in Ξ; with this many nodes Talbot's contour encloses all poles for the times in use.

Origin: Talbot (1979) as in mpmath.invertlaplace. Tolerance: 1e-20. Checked against `tests.references.laplace` and
matrix exponentials in tests/references/test_laws.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike

_DIGITS, _NODES = 100, 200


@dataclass(frozen=True)
class Action:
    """-G a(ξ): a gain (m, m), and for each component the order of a derivative, or the time constant of a lag."""

    gain: ArrayLike
    orders: Sequence[float] = ()
    """γ in [-1, 1]."""
    time_constants: Sequence[float] = ()

    def factors(self, sigma: Any) -> list[tuple[Any, Any]]:
        """Return f and g of each component."""
        if self.time_constants:
            return [(sigma / (t * sigma + 1), 1 / (t * sigma + 1)) for t in map(mpmath.mpf, self.time_constants)]
        powers = [sigma ** mpmath.mpf(order) for order in self.orders]
        return [(f, f / sigma if order > 0 else 0) for f, order in zip(powers, self.orders, strict=True)]


@dataclass(frozen=True)
class ActedLoop:
    """A plant of m positions under a law, with its start."""

    stiffness: ArrayLike
    damping: ArrayLike
    actions: Sequence[Action]
    start: Sequence[float]
    """[ξ(0), ξ'(0)], (2m,)."""

    def transforms(self, sigma: Any) -> list[Any]:
        """Return Ξ and Υ, 2m numbers."""
        m = len(self.start) // 2
        value, rate = mpmath.matrix(self.start[:m]), mpmath.matrix(self.start[m:])
        stiffness, damping = _matrix(self.stiffness, m), _matrix(self.damping, m)
        gain, history = mpmath.zeros(m), mpmath.zeros(m, 1)
        for action in self.actions:
            matrix, factors = _matrix(action.gain, m), action.factors(sigma)
            gain += matrix * mpmath.diag([f for f, _ in factors])
            history += matrix * mpmath.diag([g for _, g in factors]) * value
        left = mpmath.eye(m) * sigma**2 - damping * sigma - stiffness + gain
        position = mpmath.lu_solve(left, value * sigma + rate - damping * value + history)
        return [*position, *(history - gain * position)]

    def at(self, time: float) -> np.ndarray:
        """Return [ξ, υ] at a time > 0, (2m,)."""
        known: dict[Any, list[Any]] = {}

        def transform(index: int, sigma: Any) -> Any:
            if sigma not in known:
                known[sigma] = self.transforms(sigma)
            return known[sigma][index]

        with mpmath.workdps(_DIGITS):
            values = [
                mpmath.invertlaplace(lambda s, i=i: transform(i, s), time, method="talbot", degree=_NODES)
                for i in range(len(self.start))
            ]
        return np.array([float(value) for value in values])


def _matrix(entries: ArrayLike, m: int) -> Any:
    return mpmath.matrix(np.reshape(entries, (m, m)).astype(float).tolist())
