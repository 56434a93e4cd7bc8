"""Members side by side: the layout that the compiled loops of the contour solver work in.

Members come in blocks of `LANES`, with the members of a block as the last axis of every array. All inner loops run
over them: their length is known at compile time, so that they become vector instructions without remainder, and
the workspace of one block stays in the cache.
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.compiling import helper

LANES = 64
"""Members of a block."""
WIDTH = np.uint64(LANES)
"""The same for compiled loops: places computed without signs need no test for negative ones, which bars vectors."""


def lanes(values: Floats, members: Array) -> Floats:
    """Return some of the members of values (…, b) as blocks (blocks, …, LANES), the last member filling up."""
    padded = np.minimum(np.arange(-(-len(members) // LANES) * LANES), len(members) - 1).reshape(-1, LANES)
    return np.ascontiguousarray(np.moveaxis(values[..., members[padded]], -2, 0))


@helper
def larger(a: float, b: float) -> float:
    """Return the larger of two numbers; NaN if one is."""
    return a if b <= a or a != a else b
