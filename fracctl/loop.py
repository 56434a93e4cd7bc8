"""The closed loop of a plant and a law, as an equation in data."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fracctl.arrays import Floats, batch_size
from fracctl.controllers.linear import LinearLaw, ModelBasedLaw
from fracctl.errors import ArgumentError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import FractionalTerm
from fracctl.plants.linear import LinearPlant


@dataclass(frozen=True)
class ClosedLoop:
    """A plant under a control law.

    Args:
        plant: what is controlled, e.g. `fracctl.plants.HCWOutOfPlane()`.
        controller: the law, e.g. `fracctl.controllers.PDAlpha(k_p=0.85, k_d=2.0, alpha=0.91)`.

    Raises:
        ArgumentError: the shapes of the law's gains do not fit the plant.
    """

    plant: LinearPlant
    controller: LinearLaw | ModelBasedLaw

    def __post_init__(self) -> None:
        self.system  # noqa: B018 - a wrong shape is refused here, where the user sees which loop it is

    @cached_property
    def system(self) -> LinearFractionalSystem:
        """The loop as a linear fractional system."""
        m = self.plant.n_controls
        given = self.controller
        law = (given.for_plant(self.plant) if isinstance(given, ModelBasedLaw) else given).linear_terms(m)
        q = law.n_auxiliary
        identity = FractionalTerm(np.eye(m + q), np.array([2.0] * m + [1.0] * q))
        free = [
            FractionalTerm(_pad(-self.plant.damping, 0, q, q), np.ones(m + q)),
            FractionalTerm(_pad(-self.plant.stiffness, 0, q, q), np.zeros(m + q)),
        ]
        feedback = [FractionalTerm(_pad(-term.matrix, 0, q, 0), term.orders) for term in law.control]
        memory = [FractionalTerm(_pad(-term.matrix, m, 0, 0), term.orders) for term in law.auxiliary]
        terms = law.control + law.auxiliary
        sizes = {f"matrix_{i}": (term.matrix, 2) for i, term in enumerate(terms)}
        sizes |= {f"orders_{i}": (term.orders, 1) for i, term in enumerate(terms)}
        initial = np.zeros(0) if law.auxiliary_initial is None else law.auxiliary_initial
        return LinearFractionalSystem(
            m, q, (identity, *free, *feedback, *memory), law.control, initial, batch_size(**sizes)
        )

    @property
    def batch(self) -> int | None:
        """Batch size b, None for a single loop."""
        return self.system.batch

    def initial_values(self, initial_state: Floats) -> tuple[Floats, Floats]:
        """Split states (…, 2m) or (…, 2m+q) into y(0) and y'(0), (…, m+q); y' of auxiliary states is not needed."""
        m, q = self.system.n_positions, self.system.n_auxiliary
        if initial_state.ndim not in (1, 2) or initial_state.shape[-1] not in (2 * m, 2 * m + q):
            allowed = f"must have shape ({2 * m},) or (b, {2 * m})"
            raise ArgumentError("initial_state", f"of shape {initial_state.shape}", allowed)
        lead = initial_state.shape[:-1]
        if initial_state.shape[-1] == 2 * m + q:
            z0 = initial_state[..., 2 * m :]
        else:
            z0 = np.broadcast_to(self.system.auxiliary_initial, (*lead, q))
        value = np.concatenate([initial_state[..., :m], z0], axis=-1)
        rate = np.concatenate([initial_state[..., m : 2 * m], np.zeros((*lead, q))], axis=-1)
        return value, rate


def _pad(matrix: Floats, rows_before: int, rows_after: int, columns_after: int) -> Floats:
    rows, columns = matrix.shape[-2:]
    padded = np.zeros((*matrix.shape[:-2], rows_before + rows + rows_after, columns + columns_after))
    padded[..., rows_before : rows_before + rows, :columns] = matrix
    return padded
