"""Responses of a batch of linear fractional loops on the windows of a plan.

One fill of the transforms Z̃ = σ^ℓ Z of z = y - y(0) serves every derivative of every coordinate: D^γ z(t) is a real
matrix product with the kernel of σ^(γ - ℓ), in which no initial value cancels.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.solvers.contour.engine import Members, Outputs, respond_blocks
from fracctl.solvers.contour.lanes import LANES, lanes
from fracctl.solvers.contour.loops import Loops
from fracctl.solvers.contour.plan import Plan
from fracctl.solvers.contour.tables import tables
from fracctl.solvers.outputs import Values

_AT_ONCE = 384
"""Trajectories solved at once: few enough that their memory is used again instead of fetched anew."""
SAFETY = 6.0
"""Estimate over the largest difference seen: the two rules and the times compared are few."""


def responses(loops: Loops, rows: Array, plan: Plan) -> Iterator[tuple[Array, Values, Booleans]]:
    """Solve the members `rows` of some loops on the grid of a plan, some of them at a time.

    Yields:
        Members, their values, with the differences of the two quadrature rules and the remainders of interpolation
        and series as their error, and whether (b,) every contour has all poles on its left.
    """
    step = LANES * max(_AT_ONCE // (LANES * loops.initial.shape[2]), 1)
    prepared = len(rows) if loops.shared else step
    for start in range(0, len(rows), prepared):
        some = _Members(loops, rows[start : start + prepared], plan)
        for first in range(0, len(some.rows), step):
            yield some.rows[first : first + step], *some.respond(first, first + step)


class _Members:
    """Some members in blocks, with what the engine needs to know of them and of the plan."""

    def __init__(self, loops: Loops, rows: Array, plan: Plan) -> None:
        self._loops, self.rows, self._plan = loops, rows, plan
        table, self._start, self._windows = tables(plan, loops, rows)
        entries, sources, initial = (lanes(part, rows) for part in (loops.entries, loops.sources, loops.initial))
        self._members = Members(
            table,
            entries.reshape(len(entries), -1),
            sources.reshape(*sources.shape[:2], -1),
            lanes(loops.feeds, rows),
            initial.reshape(*initial.shape[:3], -1),
            lanes(_growth(loops, plan), rows),
            lanes(loops.added, rows),
            lanes(loops.gains, rows),
        )

    def respond(self, first: int, stop: int) -> tuple[Values, Booleans]:
        """Solve the members from `first`, which begins a block, to `stop`."""
        loops, rows = self._loops, self.rows[first:stop]
        k, b, (m, q), nodes = loops.initial.shape[2], len(rows), loops.sizes, len(self._plan.grid.times)
        others = len(loops.wanted.stored) - m
        outputs = Outputs(
            np.empty((k, b, m, nodes)),
            np.empty((k, b, others, nodes)),
            np.empty((k, b, m, nodes)),
            np.empty((k, b, m)),
            np.empty((k, b, 2)),
            np.empty((k, b, 2)),
            np.empty(b, dtype=np.bool_),
        )
        respond_blocks(loops.matrix, self._start, self._windows, loops.wanted, self._members, first // LANES, outputs)
        peaks = outputs.peaks
        peaks[..., 0] = np.maximum(peaks[..., 0], np.abs(loops.initial[0, :m][..., rows]).max(axis=0))
        errors = np.divide(SAFETY * outputs.errors, peaks, out=np.zeros_like(peaks), where=peaks != 0.0)
        found = Values(
            positions=outputs.positions,
            rates=outputs.others[:, :, q:] if others > q else None,
            auxiliary=outputs.others[:, :, :q],
            controls=outputs.controls,
            initial_controls=outputs.initial_controls,
            error=errors.max(axis=-1),
        )
        return found, outputs.enclosed


def _growth(loops: Loops, plan: Plan) -> Floats:
    """Return the remainder of each derivative over that of the series, (w, b).

    The omitted power, differentiated: Γ(e + 1) / Γ(e - γ + 1) grows at most as e^γ.
    """
    end, cut = plan.grid.panels[0].end, loops.recipe.cut
    orders = [np.maximum(wanted.order, 0.0) for wanted in loops.derivatives]
    growth = [end ** (cut - order) * (cut + 1.0) ** order for order in orders]
    return np.stack([np.broadcast_to(each, loops.entries.shape[-1:]) for each in growth])
