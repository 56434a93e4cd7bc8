"""What every peer offers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tests.references.loops import Floats, Loop


@dataclass(frozen=True)
class Solution:
    """A trajectory at times that the peer chose or was given."""

    times: Floats
    """(t,), without 0."""
    positions: Floats
    """(t, m)."""
    controls: Floats
    """(t, m)."""


class Peer(Protocol):
    """A package with a setting."""

    package: str
    method: str
    setting: str
    loops: int
    """Loops that a call solves together."""
    ladder: bool
    """Whether the setting is one of several that trade time for accuracy."""

    def __call__(self, loops: Sequence[Loop], horizon: float) -> list[Solution]:
        """Solve loops with equal orders on [0, horizon]."""
        ...


def output_times(horizon: float, count: int = 401) -> Floats:
    """Return the uniform times for peers that can be asked for any."""
    return np.linspace(0.0, horizon, count + 1)[1:]
