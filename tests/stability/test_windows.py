"""Intervals of positive values."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.stability.windows import windows


@pytest.mark.parametrize(
    ("values", "found"),
    [
        ([-1.0, 1.0, 1.0, -3.0], [(0.5, 2.25)]),
        ([1.0, 1.0, -1.0, 1.0], [(0.0, 1.5), (2.5, 3.0)]),
        ([-1.0, -1.0, -1.0, -1.0], []),
        ([np.nan, 1.0, 1.0, np.nan], [(1.0, 2.0)]),
        ([-1.0, 0.0, 1.0, 1.0], [(1.0, 3.0)]),
    ],
)
def test_windows(values: list[float], found: list[tuple[float, float]]) -> None:
    assert windows(np.arange(4.0), np.array(values)) == found
