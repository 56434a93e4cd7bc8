"""Members of a batch of loops: what they start from, and which of them share their orders."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite
from fracctl.errors import ArgumentError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop


@dataclass(frozen=True)
class Members:
    """Some members of a batch, what they start from and what is known of them."""

    system: LinearFractionalSystem
    y0: Floats
    """y(0), (k, b, p) or (k, 1, p)."""
    rate: Floats
    """y'(0), as y0."""
    horizon: float
    every: bool
    """Whether unstable members want a trajectory and all members rates."""
    rows: Array = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """Numbers of the members in the whole batch, (b,)."""
    stable: Array = field(default_factory=lambda: np.zeros(0, dtype=object))
    """Verdicts, (b,), once known."""

    def take(self, which: Array) -> Members:
        """Return some of the members; orders they share lose their batch axis."""
        return replace(
            self,
            system=_with_shared_orders(self.system.take(which)),
            y0=self.y0[:, which] if self.y0.shape[1] > 1 else self.y0,
            rate=self.rate[:, which] if self.rate.shape[1] > 1 else self.rate,
            rows=self.rows[which] if self.rows.size else which,
            stable=self.stable[which] if self.stable.size else self.stable,
        )

    def initial_states(self) -> Floats:
        """Return [ξ(0), ξ'(0), z(0)], (k, b, n)."""
        m = self.system.n_positions
        start = np.concatenate([self.y0[..., :m], self.rate[..., :m], self.y0[..., m:]], axis=-1)
        return np.broadcast_to(start, (len(start), len(self.rows), start.shape[-1]))


def _with_shared_orders(system: LinearFractionalSystem) -> LinearFractionalSystem:
    def shared(term: FractionalTerm) -> FractionalTerm:
        equal = term.orders.ndim == 2 and np.all(term.orders == term.orders[:1])
        return FractionalTerm(term.matrix, term.orders[0]) if equal else term

    dynamics, control = (tuple(shared(term) for term in terms) for terms in (system.dynamics, system.control))
    return replace(system, dynamics=dynamics, control=control)


def equal_orders(system: LinearFractionalSystem, fewest: int) -> Iterator[Array]:
    """Yield groups of members: those that share all orders, and together those that share them with too few.

    The latter have each order in one of (-∞, 0], (0, 1] and (1, 2]: initial values enter a derivative in another way
    in each of them.

    Args:
        system: the batch.
        fewest: number of members with equal orders that are worth a group of their own.
    """
    batch = system.batch or 1
    own = [term.orders for term in (*system.dynamics, *system.control) if term.orders.ndim == 2]
    different = [column for orders in own for column in orders.T if np.any(column != column[0])]
    if not different:
        yield np.arange(batch)
        return
    which = _alike(different)
    counts = np.bincount(which)
    few = np.flatnonzero(counts[which] < fewest)
    if few.size:
        kind = _alike([np.digitize(column[few], (0.0, 1.0), right=True) for column in different])
        yield from (few[kind == value] for value in range(kind.max() + 1))
    for value in np.flatnonzero(counts >= fewest):
        yield np.flatnonzero(which == value)


def _alike(columns: list[Array]) -> Array:
    """Return numbers of members (b,) that are equal where these are equal in all columns (b,)."""
    which = np.zeros(len(columns[0]), dtype=np.intp)
    for column in columns:
        values, numbers = np.unique(column, return_inverse=True)
        which = np.unique(which * len(values) + numbers, return_inverse=True)[1]
    return which


def starting_states(loop: ClosedLoop, initial_state: ArrayLike) -> tuple[Floats, bool]:
    """Return x(0) of all members of a loop with a plant in state form, (b, n), and whether there is a batch axis.

    Raises:
        ArgumentError: a shape does not fit.
    """
    given, n = finite("initial_state", initial_state), loop.plant.n_states
    if given.ndim not in (1, 2) or given.shape[-1] != n:
        raise ArgumentError("initial_state", f"of shape {given.shape}", f"must have shape ({n},) or (b, {n})")
    batch = common_batch(loop.batch, len(given) if given.ndim == 2 else None)
    return np.array(np.broadcast_to(given, (batch, n))), loop.batch is not None or given.ndim == 2


def common_batch(loop: int | None, states: int | None) -> int:
    """Return the batch size that a loop and its initial states have together."""
    sizes = {size for size in (loop, states) if size is not None and size != 1}
    if len(sizes) > 1:
        allowed = f"must have the batch size of the loop, {loop}"
        raise ArgumentError("initial_state", f"a batch of {states}", allowed)
    return sizes.pop() if sizes else 1


def whole(name: str, value: object, lowest: int, highest: int) -> int:
    """Return a whole number of a range, or refuse it."""
    if not (isinstance(value, int | np.integer) and lowest <= value <= highest):
        raise ArgumentError(name, value, f"must be a whole number from {lowest} to {highest}")
    return int(value)
