"""The closed loop of a plant and a law, as an equation in data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np

from fracctl.arrays import Floats, batch_size
from fracctl.controllers.delayed_feedback import DelayedLaw, DelayedTerm
from fracctl.controllers.linear import LinearLaw, LinearLawTerms, ModelBasedLaw
from fracctl.controllers.memory import MemoryLaw
from fracctl.controllers.saturation import Saturation
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import FractionalTerm
from fracctl.plants.capabilities import LimitedPlant, LinearPeriodicPlant, batch_of
from fracctl.plants.linear import LinearPlant
from fracctl.plants.state import StatePlant


class Need(StrEnum):
    """What a solver must be able to do."""

    FRACTIONAL_TERMS = "fractional terms"
    NONLINEAR_PLANT = "a nonlinear plant"
    PERIODIC_PLANT = "a linear plant with periodic coefficients"
    DELAYS = "delayed states"
    SATURATION = "a saturated control"
    NONLINEAR_LAW = "a nonlinear law with memory"


@dataclass(frozen=True)
class ClosedLoop:
    """A plant under a control law.

    Args:
        plant: what is controlled, e.g. `fracctl.plants.HCWOutOfPlane()`.
        controller: the law, e.g. `fracctl.controllers.PDAlpha(k_p=0.85, k_d=2.0, alpha=0.91)`; None for free motion.
        saturation: what the thrusters can give; None for the limits of the plant, if it has any, and `Saturation(inf)`
            for no limits even so.

    Raises:
        ArgumentError: a class stands for a plant or a law, or the shapes of the law's gains, its history or the limits
            do not fit the plant.
        UnsupportedError: the law's gains follow from the matrices of a linear plant, and this one has none.
    """

    plant: LinearPlant | StatePlant
    controller: LinearLaw | ModelBasedLaw | DelayedLaw | MemoryLaw | None = None
    saturation: Saturation | None = None

    def __post_init__(self) -> None:
        parts: dict[str, object] = {"plant": self.plant, "controller": self.controller}
        for name, given in parts.items():
            if isinstance(given, type):
                cure = f"make one of it, {given.__name__}(…)"
                raise ArgumentError(name, f"the class {given.__name__}", "must be an object", cure)
        if self.saturation is None and self.controller is not None and isinstance(self.plant, LimitedPlant):
            object.__setattr__(self, "saturation", Saturation(self.plant.limits, "axis"))
        elif self.saturation is not None and self.saturation.is_none:
            object.__setattr__(self, "saturation", None)
        if self.saturation is not None:
            self.saturation.check(self.plant.n_controls)
        self.batch  # noqa: B018 - a wrong shape is refused here, where the user sees which loop it is
        self._check_history()

    def _check_history(self) -> None:
        history = self.controller.history if isinstance(self.controller, DelayedLaw) else None
        if history is not None:
            shortest = min(float(np.min(term.delay)) for term in self.delayed_terms)
            past = history(np.full((self.batch or 1, 1), -0.5 * shortest))
            states = np.atleast_1d(past).shape[-1]
            if states not in (1, self.plant.n_states):
                allowed = f"must have one number or the {self.plant.n_states} states of the plant"
                raise ArgumentError("history", f"of {states}", allowed)

    @property
    def needs(self) -> frozenset[Need]:
        """What a solver of this loop must be able to do; nothing for the free motion of a linear plant."""
        needs = set()
        if not isinstance(self.plant, LinearPlant):
            periodic = isinstance(self.plant, LinearPeriodicPlant)
            needs.add(Need.PERIODIC_PLANT if periodic else Need.NONLINEAR_PLANT)
        if isinstance(self.controller, DelayedLaw):
            needs.add(Need.DELAYS)
        elif isinstance(self.controller, MemoryLaw):
            needs.add(Need.NONLINEAR_LAW)
        elif self.controller is not None:
            needs.add(Need.FRACTIONAL_TERMS)
        if self.saturation is not None:
            needs.add(Need.SATURATION)
        return frozenset(needs)

    @cached_property
    def delayed_terms(self) -> tuple[DelayedTerm, ...]:
        """The delayed terms of the control."""
        law = self.controller
        return law.delayed_terms(self.plant.n_states, self.plant.n_controls) if isinstance(law, DelayedLaw) else ()

    @cached_property
    def law_terms(self) -> LinearLawTerms:
        """The law as data; free motion has one term that is zero.

        Raises:
            UnsupportedError: it is no linear law, or its gains follow from a linear plant and this one is not.
        """
        plant, law = self.plant, self.controller
        m = plant.n_controls
        if law is None:
            return LinearLawTerms((FractionalTerm(np.zeros((m, m)), np.zeros(m)),))
        if isinstance(law, DelayedLaw | MemoryLaw):
            found = Need.DELAYS if isinstance(law, DelayedLaw) else Need.NONLINEAR_LAW
            raise UnsupportedError(f"a linear law is asked for, but this loop has {found}")
        if not isinstance(law, ModelBasedLaw):
            return law.linear_terms(m)
        if not isinstance(plant, LinearPlant):
            name = f"{type(law).__name__} takes its gains from a linear plant, but {type(plant).__name__} is not"
            raise UnsupportedError(f"{name}; take PD with the gains of its linearisation")
        return law.for_plant(plant).linear_terms(m)

    @cached_property
    def system(self) -> LinearFractionalSystem:
        """The loop as a linear fractional system.

        Raises:
            UnsupportedError: it is not one.
        """
        plant = self.plant
        if not isinstance(plant, LinearPlant) or isinstance(self.controller, DelayedLaw | MemoryLaw):
            found = " and ".join(sorted(self.needs))
            raise UnsupportedError(
                f"a linear fractional loop with constant coefficients is asked for, but this one has {found}"
            )
        m, law = plant.n_controls, self.law_terms
        q = law.n_auxiliary
        identity = FractionalTerm(np.eye(m + q), np.array([2.0] * m + [1.0] * q))
        free = [
            FractionalTerm(_pad(-plant.damping, 0, q, q), np.ones(m + q)),
            FractionalTerm(_pad(-plant.stiffness, 0, q, q), np.zeros(m + q)),
        ]
        feedback = [FractionalTerm(_pad(-term.matrix, 0, q, 0), term.orders) for term in law.control]
        memory = [FractionalTerm(_pad(-term.matrix, m, 0, 0), term.orders) for term in law.auxiliary]
        return LinearFractionalSystem(
            m, q, (identity, *free, *feedback, *memory), law.control, self._auxiliary_initial, _law_batch(law)
        )

    @property
    def batch(self) -> int | None:
        """Batch size b, None for a single loop."""
        limited = None if self.saturation is None else self.saturation.batch
        law = self.controller
        if isinstance(law, DelayedLaw):
            own = {term.batch for term in self.delayed_terms}
        else:
            own = {law.batch if isinstance(law, MemoryLaw) else _law_batch(self.law_terms)}
        sizes = sorted(size for size in {limited, batch_of(self.plant), *own} if size is not None)
        if len({*sizes} - {1}) > 1:
            found = f"in a loop of batches of {' and '.join(map(str, sizes))}"
            raise ArgumentError("controller", found, "must have one batch size with the plant and the limits")
        return max(sizes, default=None)

    def initial_values(self, initial_state: Floats) -> tuple[Floats, Floats]:
        """Split states (…, 2m) or (…, 2m+q) into y(0) and y'(0), (…, m+q); y' of auxiliary states is not needed."""
        m, q = self.plant.n_controls, self.law_terms.n_auxiliary
        if initial_state.ndim not in (1, 2) or initial_state.shape[-1] not in (2 * m, 2 * m + q):
            allowed = f"must have shape ({2 * m},) or (b, {2 * m})"
            raise ArgumentError("initial_state", f"of shape {initial_state.shape}", allowed)
        lead = initial_state.shape[:-1]
        if initial_state.shape[-1] == 2 * m + q:
            z0 = initial_state[..., 2 * m :]
        else:
            z0 = np.broadcast_to(self._auxiliary_initial, (*lead, q))
        value = np.concatenate([initial_state[..., :m], z0], axis=-1)
        rate = np.concatenate([initial_state[..., m : 2 * m], np.zeros((*lead, q))], axis=-1)
        return value, rate

    @property
    def _auxiliary_initial(self) -> Floats:
        initial = self.law_terms.auxiliary_initial
        return np.zeros(0) if initial is None else initial


def _law_batch(law: LinearLawTerms) -> int | None:
    terms = law.control + law.auxiliary
    sizes = {f"matrix_{i}": (term.matrix, 2) for i, term in enumerate(terms)}
    return batch_size(**sizes, **{f"orders_{i}": (term.orders, 1) for i, term in enumerate(terms)})


def _pad(matrix: Floats, rows_before: int, rows_after: int, columns_after: int) -> Floats:
    rows, columns = matrix.shape[-2:]
    padded = np.zeros((*matrix.shape[:-2], rows_before + rows + rows_after, columns + columns_after))
    padded[..., rows_before : rows_before + rows, :columns] = matrix
    return padded
