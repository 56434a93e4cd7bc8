"""Pattern search for many related problems at a time, with random directions beside the axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Floats

FIRST_STEP = 0.05
"""Of the width of the box."""
_DECIMALS = 12
"""Points are rounded, so that a step there and back leads to the same point."""


@dataclass(frozen=True)
class Descent:
    """Where searches have ended."""

    points: Floats
    """(p, n)."""
    values: Floats
    """(p,); infinite where nothing admissible was found."""
    evaluations: int
    """How many each search has spent."""


def neighbours(n: int) -> int:
    """Return how many neighbours a point with n coordinates has."""
    return 4 * n


def descend(
    value: Callable[[Floats], Floats],
    points: Floats,
    values: Floats,
    box: tuple[Floats, Floats],
    evaluations: int,
    seed: Sequence[int],
    first_step: float = FIRST_STEP,
) -> Descent:
    """Move the points of p problems to better neighbours; a point that has none halves its step.

    The neighbours of a point lie a step away along both directions of the n axes and of 2n random ones, clipped to
    the box: the settling time jumps along curves, and along the axes alone a search ends where it meets one. What is
    a neighbour in one problem is looked at in the others too, where `value` says so.

    Args:
        value: of points (p, c, n) in the p problems, (p, p c) if every problem looks at all of them, or (p, c) if
            each looks at its own; infinite where they are not admissible.
        points: where the searches start, (p, n).
        values: there, (p,).
        box: lower and upper bounds, each (p, n).
        evaluations: at most, of each search: as many whole rounds of neighbours as there are room for.
        seed: of the random directions.
        first_step: of the width of the box.
    """
    count, n = points.shape
    lower, upper = box
    random = np.random.default_rng(list(seed))
    step, everyone = np.full(count, first_step), np.arange(count)
    rounds = evaluations // neighbours(n)
    for _ in range(rounds):
        oblique = random.standard_normal((2 * n, n))
        oblique /= np.linalg.norm(oblique, axis=1, keepdims=True)
        directions = np.concatenate([np.eye(n), -np.eye(n), oblique])
        moved = points[:, None] + step[:, None, None] * (upper - lower)[:, None] * directions
        around = np.round(np.clip(moved, lower[:, None], upper[:, None]), _DECIMALS)
        found = value(around)
        best = np.argmin(found, axis=1)
        reached = found[everyone, best]
        better = reached < values
        chosen = around[everyone, best] if found.shape == around.shape[:2] else around.reshape(-1, n)[best]
        points = np.where(better[:, None], chosen, points)
        values = np.where(better, reached, values)
        step = np.where(better, step, 0.5 * step)
    return Descent(points, values, rounds * neighbours(n))
