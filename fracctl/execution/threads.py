"""One thread in the linear algebra libraries: the last bits of a product depend on how many there are."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import scipy.linalg  # noqa: F401 - the library that SciPy brings must be loaded before it can be limited
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

_VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
SINGLE_THREAD = dict.fromkeys(_VARIABLES, "1")
"""What limits a process that has yet to load them."""


@contextmanager
def single_threaded() -> Iterator[None]:
    """Limit this process meanwhile."""
    with ThreadpoolController().limit(limits=1):
        yield
