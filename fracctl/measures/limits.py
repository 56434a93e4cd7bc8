"""What a measured column must keep to."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.errors import ArgumentError

_FORM = re.compile(r"\s*(>=|<=)\s*(\S+)\s*")


@dataclass(frozen=True)
class Limit:
    """A least or a largest value."""

    value: float
    least: bool
    """Whether it is the least."""

    def excess(self, values: Floats) -> Floats:
        """Return how far values lie beyond, over the limit's size, (n,); 0 within, inf for NaN."""
        beyond = (self.value - values if self.least else values - self.value) / (abs(self.value) or 1.0)
        return np.where(np.isnan(beyond), np.inf, np.maximum(beyond, 0.0))


def limit(text: str) -> Limit:
    """Return what ``>= 45`` or ``<= 1.4`` says.

    Raises:
        ArgumentError: it says something else.
    """
    found = _FORM.fullmatch(text)
    try:
        value = float(found[2]) if found else math.nan
    except ValueError:
        value = math.nan
    if found is None or not math.isfinite(value):
        raise ArgumentError("constraints", repr(text), "must be '>= number' or '<= number', in quotes")
    return Limit(value, found[1] == ">=")


def excess(rows: Mapping[str, Array], limits: Mapping[str, Limit]) -> Floats:
    """Return the sum of what rows exceed limits by, (n,)."""
    total: Floats = np.zeros(len(next(iter(rows.values()))))
    for column, allowed in limits.items():
        total = total + allowed.excess(rows[column])
    return total
