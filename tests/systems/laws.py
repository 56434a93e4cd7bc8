"""Laws that are data only: they exercise auxiliary states and integrals of the general linear form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.controllers import LinearLawTerms
from fracctl.fractional.terms import FractionalTerm


@dataclass(frozen=True)
class Lag:
    """υ = -k_P w - k_D z, T z' = w' - z: PD with a lag in its derivative, one auxiliary state."""

    k_p: float
    k_d: float
    time: float

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        control = (FractionalTerm(np.array([[-self.k_p, -self.k_d]]), np.zeros(2)),)
        auxiliary = (
            FractionalTerm(np.array([[1.0 / self.time, 0.0]]), np.array([1.0, 0.0])),
            FractionalTerm(np.array([[0.0, -1.0 / self.time]]), np.zeros(2)),
        )
        return LinearLawTerms(control, auxiliary, np.zeros(1))

    def companion(self) -> np.ndarray:
        """Return the matrix of [w w' z]' for w'' = -w + υ."""
        return np.array([[0, 1, 0], [-1 - self.k_p, 0, -self.k_d], [0, 1 / self.time, -1 / self.time]])


@dataclass(frozen=True)
class PID:
    """υ = -k_P w - k_D w' - k_I ∫w: an order of -1."""

    k_p: float
    k_d: float
    k_i: float

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        gains = ((self.k_p, 0.0), (self.k_d, 1.0), (self.k_i, -1.0))
        return LinearLawTerms(tuple(FractionalTerm(np.array([[-gain]]), np.array([order])) for gain, order in gains))

    def companion(self) -> np.ndarray:
        """Return the matrix of [w w' ∫w]' for w'' = -w + υ."""
        return np.array([[0, 1, 0], [-1 - self.k_p, -self.k_d, -self.k_i], [1, 0, 0]])
