"""Where in a survey a quantity has the right sign, between its points too."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats


def windows(x: Floats, values: Floats) -> list[tuple[float, float]]:
    """Return the intervals in which piecewise linear values at increasing x (k,) are positive; unknown ones are not."""
    found: list[tuple[float, float]] = []
    for a, b, left, right in zip(x[:-1], x[1:], values[:-1], values[1:], strict=True):
        if not max(left, right) > 0.0 or np.isnan(left + right):
            continue
        zero = a + (b - a) * left / (left - right) if min(left, right) < 0.0 else a
        start, end = (float(zero) if left < 0.0 else float(a)), (float(zero) if right < 0.0 else float(b))
        if found and found[-1][1] == start:
            start = found.pop()[0]
        found.append((start, end))
    return found
