"""How kernels are compiled: at their first call, by numba, for the next process too where a directory is writable."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def forget_outdated(package: Path) -> None:
    """Remove the machine code beside the modules of a package if any module with kernels is newer.

    numba compiles a kernel again when its own module has changed, but not when one that it calls has.
    """
    try:
        stored = list(package.rglob("__pycache__/*.nbi"))
        modules = {path.parents[1] / f"{path.name.partition('.')[0]}.py" for path in stored}
        newest = max((path.stat().st_mtime for path in modules if path.exists()), default=0.0)
        if any(path.stat().st_mtime < newest for path in stored):
            for path in stored:
                path.unlink(missing_ok=True)
    except OSError:
        return


forget_outdated(Path(__file__).parent)


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
