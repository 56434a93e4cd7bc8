"""Names and ranges of a law's scalar parameters: the keys of its configuration and the columns of its tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Parameter:
    """One scalar of a law, e.g. ``k_p_uv``, with the range it must lie in."""

    name: str
    """Key in the configuration, column in the tables."""
    default: float = 0.0
    """Value where the configuration gives none."""
    lower: float = -math.inf
    """Lower end of the range."""
    upper: float = math.inf
    """Upper end of the range, itself allowed."""
    lower_allowed: bool = True
    """Whether the lower end itself is allowed."""
    upper_allowed: bool = True
    """Whether the upper end itself is allowed."""
    kind: Literal["gain", "order", "time", "weight"] = "gain"
    """What it is: surveys vary gains and orders in different ways."""

    def contains(self, value: float) -> bool:
        """Whether `value` lies in the range; False for NaN and infinities."""
        above = value >= self.lower if self.lower_allowed else value > self.lower
        below = value <= self.upper if self.upper_allowed else value < self.upper
        return math.isfinite(value) and above and below

    @property
    def allowed(self) -> str:
        """The range in words, e.g. ``must lie in (0, 1]``."""
        if math.isinf(self.lower) and math.isinf(self.upper):
            return "must be a finite number"
        bracket = "[" if self.lower_allowed and math.isfinite(self.lower) else "("
        close = "]" if self.upper_allowed and math.isfinite(self.upper) else ")"
        return f"must lie in {bracket}{self.lower:g}, {self.upper:g}{close}"


def entry_name(prefix: str, row: str, column: str) -> str:
    """Name of a matrix entry: ``k_p_u`` on the diagonal, ``k_p_uv`` off it (``k_p_x1_x2`` for longer names)."""
    if row == column:
        return f"{prefix}_{row}"
    joint = "" if len(row) == len(column) == 1 else "_"
    return f"{prefix}_{row}{joint}{column}"


def entry_names(prefix: str, components: Sequence[str]) -> list[list[str]]:
    """Names of all entries of a gain matrix over `components`, row by row."""
    return [[entry_name(prefix, row, column) for column in components] for row in components]
