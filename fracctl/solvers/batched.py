"""What the solvers of batches share: shapes, verdicts, groups of equal orders, one grid for all."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite, positive
from fracctl.characteristic.bounds import pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.winding import abscissa_bound, unstable_zeros, verdicts
from fracctl.errors import UnsupportedError
from fracctl.fractional.system import LinearFractionalSystem, unsolved_for_highest
from fracctl.loop import ClosedLoop, Need
from fracctl.solvers.base import SolvedMembers
from fracctl.solvers.members import Members, common_batch, equal_orders
from fracctl.solvers.results import merged, without_trajectory
from fracctl.trajectory import Trajectory

_LARGEST_GROWTH = 200.0
"""Exponent of growth over the horizon beyond which an unstable trajectory is given up as diverged."""


class BatchSolver(ABC):
    """A solver of linear fractional loops that solves groups of members together.

    A stability verdict comes with every member: the number of zeros in the right half plane, by the argument principle.
    """

    name: str
    tolerance: float = 0.0
    cross_check: float = 0.0
    checked_by: str = "contour"
    fewest_shared = 1
    """Members with equal orders that are worth a group of their own; fewer are solved together."""

    def supports(self, loop: ClosedLoop) -> str | None:
        """Return None for a linear fractional loop, otherwise why it is refused and what to use instead."""
        beyond = sorted(loop.needs - {Need.FRACTIONAL_TERMS})
        if not beyond:
            return self._refusal(loop.system)
        found = " and ".join(beyond)
        use = "explicit_memory" if Need.FRACTIONAL_TERMS in loop.needs else "method_of_steps"
        use = "implicit_memory" if Need.NONLINEAR_LAW in loop.needs else use
        return f"the {self.name} solver takes linear fractional loops, but this one has {found}; use '{use}'"

    def solve(self, loop: ClosedLoop, initial_state: ArrayLike, horizon: float) -> Trajectory:
        """Return the trajectories of all members on one grid.

        Args:
            loop: the closed loop, of b members or a single one.
            initial_state: [ξ(0), ξ'(0)], (n,), or (b, n) one a member.
            horizon: S > 0, the last time.

        Raises:
            ArgumentError: a shape does not fit, or the horizon is not positive.
            UnsupportedError: the solver does not take the loop, or not over so long a horizon.
        """
        self._check(loop)
        state = finite("initial_state", initial_state)
        y0, rate = loop.initial_values(state)
        batch = common_batch(loop.batch, len(state) if state.ndim == 2 else None)
        system = replace(loop.system, batch=batch)
        y0, rate = (np.broadcast_to(v, (1, batch, v.shape[-1])) for v in (y0, rate))
        parts = list(self._groups(Members(system, y0, rate, positive("horizon", horizon), every=True)))
        return replace(merged(parts, batch), batched=loop.batch is not None or state.ndim == 2)

    def survey(self, loop: ClosedLoop, initial_states: ArrayLike, horizon: float) -> Iterator[SolvedMembers]:
        """Yield members group by group, each from all k initial states (k, n); unstable ones without trajectory."""
        self._check(loop)
        y0, rate = loop.initial_values(np.atleast_2d(finite("initial_states", initial_states)))
        system = replace(loop.system, batch=loop.batch or 1)
        yield from self._groups(Members(system, y0[:, None], rate[:, None], positive("horizon", horizon), every=False))

    def _check(self, loop: ClosedLoop) -> None:
        refusal = self.supports(loop)
        if refusal:
            raise UnsupportedError(refusal)

    def _groups(self, everyone: Members) -> Iterator[SolvedMembers]:
        """Split the members by orders, tell the unstable apart and solve the rest."""
        for which in equal_orders(everyone.system, self.fewest_shared):
            members = everyone.take(which)
            matrix = CharacteristicMatrix(members.system)
            radius = pole_radius(matrix)
            zeros, marginal = unstable_zeros(matrix, radius)
            members = replace(members, stable=verdicts(zeros, marginal))
            unstable = zeros > 0.0
            shift = np.zeros(len(which))
            if members.every and unstable.any():
                shift[unstable] = _growth(matrix.take(np.flatnonzero(unstable)), members.horizon)
            given_up = shift * members.horizon > _LARGEST_GROWTH if members.every else unstable
            if given_up.any():
                word = "diverged" if members.every else "unstable"
                yield without_trajectory(members.take(np.flatnonzero(given_up)), word)
            yield from self._solved(members, np.flatnonzero(~given_up), radius, shift)

    def _refusal(self, system: LinearFractionalSystem) -> str | None:
        """Return why a linear loop is refused, or None."""
        return unsolved_for_highest(system, f"the {self.name} solver")

    @abstractmethod
    def _solved(self, members: Members, rows: Array, radius: Floats, shift: Floats) -> Iterator[SolvedMembers]:
        """Solve `rows` of the members.

        Args:
            members: members that share their orders, or too few to be worth it.
            rows: which of them.
            radius: bounds on the magnitudes of their poles.
            shift: bounds on the real parts of the poles of unstable members that want a trajectory, 0 for others.
        """


def _growth(matrix: CharacteristicMatrix, horizon: float) -> Floats:
    """Bound the real parts of the poles from above, rounded to whole multiples of 1/horizon."""
    growth: Floats = np.ceil(abscissa_bound(matrix, 1.0 / horizon) * horizon) / horizon
    return growth
