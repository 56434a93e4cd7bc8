"""What a thruster can give: controls cut off at a limit, by axis or by magnitude."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite
from fracctl.errors import ArgumentError


class Saturation:
    """The control u that comes of a demand w.

        by norm:  u = w min(1, L/|w|)        by axis:  u_i = max(-L_i, min(L_i, w_i))

    By norm the direction is kept, as one engine on a gimbal gives it; by axis each pair of thrusters has its own limit.

    Args:
        limit: L > 0 over the acceleration scale of the plant. By norm () or (b,); by axis () or (m,), one for each of
            m controls, and for batches (b, 1) or (b, m). A single infinite one says that there is no limit.
        by: ``norm`` or ``axis``.

    Raises:
        ArgumentError: the limit is not positive, has a wrong shape, or `by` is another word.
    """

    def __init__(self, limit: ArrayLike, by: Literal["norm", "axis"] = "norm") -> None:
        if by not in ("norm", "axis"):
            raise ArgumentError("by", repr(by), "must be 'norm' or 'axis'")
        self.is_none, self.by = np.ndim(limit) == 0 and limit == math.inf, by
        given = np.array(math.inf) if self.is_none else finite("limit", limit)
        if not (given > 0.0).all():
            raise ArgumentError("limit", float(given.min()), "must be positive")
        if given.ndim > 2 or (by == "norm" and given.ndim == 2 and given.shape[1] > 1):
            shapes = "(), (m,), (b, 1) or (b, m)" if by == "axis" else "() or (b,)"
            raise ArgumentError("limit", f"of shape {given.shape}", f"must have shape {shapes}")
        self.limit = np.atleast_2d(given) if by == "axis" else given.reshape(-1, 1)
        shared = given.ndim == 0 or (by == "axis" and len(self.limit) == 1)
        self.batch = None if shared else len(self.limit)
        """Batch size, None for limits that all members share."""

    def __call__(self, demand: Floats) -> Floats:
        """Return the controls that come of demands (b, …, m), shaped as these."""
        limit = self._beside(demand)
        if self.by == "axis":
            return np.clip(demand, -limit, limit)
        size = np.linalg.norm(demand, axis=-1, keepdims=True)
        limited: Floats = demand * np.where(size > limit, limit / np.where(size > limit, size, 1.0), 1.0)
        return limited

    def excess(self, demand: Floats) -> Floats:
        """Return functions of demands (b, …, m) that change their signs where the control has kinks, (b, …, g)."""
        limit = self._beside(demand)
        if self.by == "axis" or demand.shape[-1] == 1:
            return np.concatenate([demand - limit, demand + limit], axis=-1)
        beyond: Floats = np.linalg.norm(demand, axis=-1, keepdims=True) - limit
        return beyond

    def take(self, rows: Array) -> Saturation:
        """Return the limits of some members."""
        return self if self.batch in (None, 1) else Saturation(self.limit[rows], self.by)

    def check(self, n_controls: int) -> None:
        """Raise ArgumentError unless the limit fits a plant with m controls."""
        if self.limit.shape[1] not in (1, n_controls):
            shapes = "() or (b, 1)" if n_controls == 1 else f"(), ({n_controls},), (b, 1) or (b, {n_controls})"
            raise ArgumentError("limit", f"of shape {self.limit.shape}", f"must have shape {shapes} for this plant")

    def _beside(self, demand: Floats) -> Floats:
        return self.limit.reshape(len(self.limit), *[1] * (demand.ndim - 2), self.limit.shape[1])
