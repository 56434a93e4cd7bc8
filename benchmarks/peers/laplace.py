"""nilt-python: inverse Laplace transform by its compiled de Hoog and fixed Talbot algorithms, time by time.

    M(σ) R = σ ξ₀' + (S - K_P) ξ₀

R/σ and σ^(α-1) R are the transforms of ξ - ξ₀ and D^α ξ, which start from 0: a jump there costs de Hoog's algorithm two
digits. The package takes all nodes of all times in one call of the transform, which NumPy then fills at once; the nodes
depend on the times alone, so all components come from one fill.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import nilt
import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.base import Solution, output_times
from tests.references.loops import Loop

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class InverseLaplace:
    """One of nilt's algorithms with its options."""

    algorithm: str
    options: Mapping[str, float]
    ladder: bool = True
    package = "nilt-python"
    loops = 1

    @property
    def method(self) -> str:
        """The algorithm in words."""
        return {"DeHoog": "de Hoog", "Talbot": "fixed Talbot"}[self.algorithm]

    @property
    def setting(self) -> str:
        """The setting in words."""
        given = ", ".join(f"{name} = {value:g}" for name, value in self.options.items())
        return given or "as it comes (M = 40, T_FACTOR = 4)"

    def __call__(self, loops: Sequence[Loop], horizon: float) -> list[Solution]:
        """Solve loops on [0, horizon]."""
        return [self._solve(loop, horizon) for loop in loops]

    def _solve(self, loop: Loop, horizon: float) -> Solution:
        times, filled = output_times(horizon), _Once(loop)
        values = [
            nilt.invert(filled.component(i), times, method=self.algorithm, options=dict(self.options))
            for i in range(2 * loop.size)
        ]
        change, caputo = np.split(np.stack(values, axis=-1), 2, axis=1)
        positions = loop.value + change
        return Solution(times, positions, -positions @ loop.k_p.T - caputo @ loop.k_d.T)


class _Once:
    """Transforms of one loop, filled at the first call and remembered for the others, which bring the same nodes."""

    def __init__(self, loop: Loop) -> None:
        self.loop = loop
        self.filled: list[Complexes] | None = None

    def component(self, i: int) -> Callable[[Complexes], Complexes]:
        def transform(sigma: Complexes) -> Complexes:
            if self.filled is None:
                self.filled = transforms(self.loop, sigma)
            return self.filled[i]

        return transform


def transforms(loop: Loop, sigma: Complexes) -> list[Complexes]:
    """Return the transforms of ξ - ξ₀ and of D^α ξ at nodes σ, 2m arrays."""
    m = range(loop.size)
    logarithm = np.log(sigma)
    powers = {order: np.exp(order * logarithm) for order in set(loop.alpha.tolist())}
    fractional = [powers[order] for order in loop.alpha.tolist()]
    start = (loop.stiffness - loop.k_p) @ loop.value
    entries = [
        [
            loop.k_d[i, j] * fractional[j]
            + (loop.k_p - loop.stiffness)[i, j]
            + sigma * (sigma * (i == j) - loop.damping[i, j])
            for j in m
        ]
        for i in m
    ]
    rate = _solve(entries, [sigma * loop.rate[i] + start[i] for i in m])
    change = [part / sigma for part in rate]
    return [*change, *(power * part for power, part in zip(fractional, change, strict=True))]


def _solve(entries: list[list[Complexes]], right: list[Complexes]) -> list[Complexes]:
    if len(right) == 1:
        return [right[0] / entries[0][0]]
    (a, b), (c, d) = entries
    scale = 1.0 / (a * d - b * c)
    return [(d * right[0] - b * right[1]) * scale, (a * right[1] - c * right[0]) * scale]
