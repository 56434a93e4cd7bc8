"""How kernels are compiled: at their first call, by numba, for the next process too where a directory is writable."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled_with(**options: Any) -> Callable[[_Function], _Function]:
    """Return a decorator that compiles a function with some options of `numba.njit`.

    The machine code is kept on disk: in NUMBA_CACHE_DIR if it is set, else beside the module or in the user's cache.
    Where none of them can be written to, every process compiles anew.
    """

    def decorate(function: _Function) -> _Function:
        kernel: _Function
        try:
            kernel = numba.njit(cache=True, **options)(function)
        except RuntimeError:
            kernel = numba.njit(**options)(function)
        return kernel

    return decorate


compiled = compiled_with(error_model="numpy", fastmath={"reassoc", "contract", "nsz", "arcp"})
"""The decorator of arithmetic that may be reordered and divides by zero as NumPy does."""
