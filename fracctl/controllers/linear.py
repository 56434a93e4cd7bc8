"""What a linear law with memory tells a closed loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fracctl.arrays import Floats
from fracctl.fractional.terms import FractionalTerm
from fracctl.plants.linear import LinearPlant


@dataclass(frozen=True)
class LinearLawTerms:
    """A linear law as data, over y = [ξ, z] with m positions ξ and q auxiliary states z.

    υ = Σ_j C_j D^{γ_j} y,        z' = Σ_j H_j D^{δ_j} y
    """

    control: tuple[FractionalTerm, ...]
    """Terms of υ; matrices (m, m+q) or (b, m, m+q), sign included."""
    auxiliary: tuple[FractionalTerm, ...] = ()
    """Terms of z'; matrices (q, m+q) or (b, q, m+q)."""
    auxiliary_initial: Floats | None = None
    """z(0), (q,); None where q = 0."""

    @property
    def n_auxiliary(self) -> int:
        """Number q of auxiliary states."""
        return 0 if self.auxiliary_initial is None else int(self.auxiliary_initial.shape[-1])


class LinearLaw(Protocol):
    """A law that is a sum of linear fractional terms."""

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        """Return the terms of the law for a plant with m = `n_controls` positions."""
        ...


@runtime_checkable
class ModelBasedLaw(Protocol):
    """A law whose gains follow from the plant."""

    def for_plant(self, plant: LinearPlant) -> LinearLaw:
        """Return the law with the gains for a plant."""
        ...
