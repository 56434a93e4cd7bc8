"""What a law with a fractional memory in the loop tells the implicit solver."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

from fracctl.arrays import Floats
from fracctl.plants.state import StatePlant

Reference = Callable[[Floats], tuple[Floats, Floats]]
"""Takes times (t,) and returns q_d and q_d' at these, each (t, m) or (b, t, m)."""


@runtime_checkable
class MemoryLaw(Protocol):
    """A law w(t, q, q', D^ν Δq, z) of the error Δq = q - q_d, with auxiliary states z' = h(t, q, q', D^ν Δq, z).

    `demand` is a function compiled by `fracctl.compiling.pointer_with(DEMAND)`. It is called with

        t, q, q', Δq, Δq', D^ν Δq (m,), c, b (p,), peaks (p,), numbers (k,), z (p,), w (m,)

    and fills the auxiliary states at the end of an implicit step, z = b + c h, and the demand w, which is not limited
    yet. `peaks` holds the largest |z| of all steps before.
    """

    @property
    def demand(self) -> Any:
        """The law as a compiled function."""
        ...

    @property
    def batch(self) -> int | None:
        """Batch size, None for a single law."""
        ...

    def numbers(self, plant: StatePlant, batch: int) -> Floats:
        """Return what the demand is computed from, (b, k)."""
        ...

    def orders(self, n_controls: int, batch: int) -> Floats:
        """Return ν in (0, 1) for each component, (b, m)."""
        ...

    def initial_memory(self, error: Floats) -> Floats:
        """Return what the memory begins with at an error Δq(0), (b, m).

        0 for the derivative of Caputo, the error for that of Riemann and Liouville.
        """
        ...

    def initial_auxiliary(self, batch: int) -> Floats:
        """Return z(0), (b, p)."""
        ...

    def reference(self, times: Floats) -> tuple[Floats, Floats]:
        """Return q_d and q_d' at times (t,), each (t, m) or (b, t, m)."""
        ...
