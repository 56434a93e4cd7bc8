"""What a thruster can give: controls cut off at a limit, by axis or by magnitude."""

from __future__ import annotations

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
        limit: L > 0, () or (b,); by axis also (1, m) or (b, m). Over the acceleration scale of the plant.
        by: ``norm`` or ``axis``.

    Raises:
        ArgumentError: the limit is not positive, has a wrong shape, or `by` is another word.
    """

    def __init__(self, limit: ArrayLike, by: Literal["norm", "axis"] = "norm") -> None:
        if by not in ("norm", "axis"):
            raise ArgumentError("by", repr(by), "must be 'norm' or 'axis'")
        self.limit, self.by = finite("limit", limit), by
        if not (self.limit > 0.0).all():
            raise ArgumentError("limit", float(self.limit.min()), "must be positive")
        if self.limit.ndim > 1 + (by == "axis"):
            shapes = "(), (b,), (1, m) or (b, m)" if by == "axis" else "() or (b,)"
            raise ArgumentError("limit", f"of shape {self.limit.shape}", f"must have shape {shapes}")

    @property
    def batch(self) -> int | None:
        """Batch size, None for limits that all members share."""
        return len(self.limit) if self.limit.ndim and (self.limit.ndim == 1 or len(self.limit) > 1) else None

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
        if self.limit.ndim == 2 and self.limit.shape[1] != n_controls:
            allowed = f"must have shape (), (b,), (1, {n_controls}) or (b, {n_controls}) for this plant"
            raise ArgumentError("limit", f"of shape {self.limit.shape}", allowed)

    def _beside(self, demand: Floats) -> Floats:
        limit = self.limit.reshape(1, 1) if self.limit.ndim == 0 else self.limit.reshape(len(self.limit), -1)
        return limit.reshape(len(limit), *[1] * (demand.ndim - 2), limit.shape[1])
