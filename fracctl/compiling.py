"""How kernels are compiled: at their first call, by numba, for the next process too where a directory is writable."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import types

_Function = TypeVar("_Function", bound=Callable[..., Any])

_ALIKE: dict[str, Any] = {"forceinline": True}
"""Every kernel holds its own copy of what it calls: which of several compiled copies is linked would depend on whether
a process compiles or loads them, and copies whose arithmetic was reordered differently do not give the same bits."""


def forget_outdated(package: Path) -> None:
    """Remove the machine code beside the modules of a package if any module with kernels or helpers is newer.

    numba compiles a kernel again when its own module has changed, but not when one that it calls has.
    """
    try:
        stored = list(package.rglob("__pycache__/*.nbi"))
        oldest = min((path.stat().st_mtime for path in stored), default=math.inf)
        kernels = {path.parents[1] / f"{path.name.partition('.')[0]}.py" for path in stored}
        newer = [path for path in package.rglob("*.py") if path.stat().st_mtime > oldest]
        if any(path in kernels or "compiling import" in path.read_text() for path in newer):
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
    options |= _ALIKE

    def decorate(function: _Function) -> _Function:
        kernel: _Function
        try:
            kernel = numba.njit(cache=True, **options)(function)
        except RuntimeError:
            kernel = numba.njit(**options)(function)
        return kernel

    return decorate


def pointer_with(signature: Any, **options: Any) -> Callable[[_Function], _Function]:
    """Return a decorator that compiles a function for one signature, at the import of its module.

    Such functions can be handed over to kernels that take a `numba.types.FunctionType` of the signature. Their
    arithmetic is not reordered: called directly or handed over they give the same bits.
    """
    options |= {"error_model": "numpy"} | _ALIKE

    def decorate(function: _Function) -> _Function:
        kernel: _Function
        try:
            kernel = numba.njit(signature, cache=True, **options)(function)
        except RuntimeError:
            kernel = numba.njit(signature, **options)(function)
        return kernel

    return decorate


def helper_with(**options: Any) -> Callable[[_Function], _Function]:
    """Return a decorator for functions that only compiled functions call, with some options of `numba.njit`.

    They are compiled and kept as parts of those: entries for Python would take a third more time to compile. To call
    one from Python is a crash.
    """
    options = _ALIKE | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True} | options

    def decorate(function: _Function) -> _Function:
        kernel: _Function = numba.njit(**options)(function)
        return kernel

    return decorate


BARE: dict[str, Any] = {"_nrt": False}
"""For functions that make no arrays: who refers to which need not be counted, which can cost a kernel half its time."""
called = helper_with(error_model="numpy", forceinline=False, **BARE)
"""The decorator of functions that only kernels call and that are not copied into them: too long, or called at many
places. Their arithmetic is not reordered, so that all compiled copies give the same bits."""
within = helper_with(error_model="numpy", **BARE)
"""The same for functions that are copied into the one kernel that calls them."""
_ARITHMETIC: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}
"""Arithmetic that may be reordered and divides by zero as NumPy does."""
compiled = compiled_with(**_ARITHMETIC)
"""The decorator of kernels."""
helper = helper_with(**_ARITHMETIC)
"""The decorator of functions that only kernels call."""
inlined = helper_with(**_ARITHMETIC, inline="always")
"""The same for a function that is called at one place, which then is not compiled apart; without branches on ndim."""
ACCELERATION = types.void(types.f8, *[types.f8[::1]] * 5)
"""Signature of accelerations that can be handed over: of t, ξ, ξ', u, the plant's parameters, and ξ'' to write to."""
DEMAND = types.void(types.f8, *[types.f8[::1]] * 5, types.f8, *[types.f8[::1]] * 5)
"""Signature of the demands of laws with memory, see `fracctl.controllers.memory.MemoryLaw`."""
