"""The least work that a shared contour can do: the real matrix products for positions and controls.

401 uniform times in (0, S] in four geometric windows of ratio 4; in each, F at N complex nodes, given as 2N real
numbers, times a fixed matrix (2N, t): N = 16, 20, 24, 36, as for an error of 1e-8. Nothing else is done: no transform
is filled in, no certificate, no measure, and the results are overwritten by the next thousand members.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

NODES = (16, 20, 24, 36)
TIMES = 401
RATIO = 4.0
CHUNK = 1024


def counts() -> list[int]:
    """Return how many of the times lie in each window."""
    times = np.arange(1, TIMES + 1) / TIMES
    edges = np.concatenate([[0.0], RATIO ** -np.arange(len(NODES) - 1.0, -1.0, -1.0)])
    return [int(n) for n in np.diff(np.searchsorted(times, edges, side="right"))]


def products(size: int, outputs: int) -> Callable[[], None]:
    """Return what does the products of `size` members with `outputs` positions and controls together."""
    generator = np.random.default_rng(0)
    transforms = [[generator.standard_normal((size, 2 * n)) for n in NODES] for _ in range(outputs)]
    kernels = [generator.standard_normal((2 * n, t)) for n, t in zip(NODES, counts(), strict=True)]
    results = [np.empty((min(CHUNK, size), t)) for t in counts()]

    def run() -> None:
        for start in range(0, size, CHUNK):
            for output in transforms:
                for transform, kernel, result in zip(output, kernels, results, strict=True):
                    chunk = transform[start : start + CHUNK]
                    np.matmul(chunk, kernel, out=result[: len(chunk)])

    return run
