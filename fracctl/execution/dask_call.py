"""What runs in a worker of a Dask cluster, and what such a worker must be to give the bits that this process gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any, TypeVar

from fracctl.execution.threads import single_threaded
from fracctl.store.identity import sources_digest

_T = TypeVar("_T")

Program = Mapping[str, str]
"""Versions by name, and the digest of the sources of fracctl."""
SOURCES = "sources of fracctl"

_DECISIVE = ("fracctl", "numpy", "scipy", "numba")


class OtherProgram(Exception):
    """A worker has other versions than the process that the survey runs in."""


@cache
def program() -> dict[str, str]:
    """Return what decides on the bits of a result in this process."""
    return {name: _version(name) for name in _DECISIVE} | {SOURCES: sources_digest()}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "an unknown version"


def difference(here: Program, there: Program) -> str | None:
    """Return in words how another process differs from this one; None if it gives the same bits."""
    for name in _DECISIVE:
        if here[name] != there.get(name):
            return f"{name} {there.get(name)} instead of {here[name]}"
    if here[SOURCES] != there.get(SOURCES):
        return f"other sources of fracctl {here['fracctl']}"
    return None


def call(expected: Program, function: Callable[..., _T], args: Sequence[Any], kwargs: Mapping[str, Any]) -> _T:
    """Call a function with one thread in the linear algebra libraries.

    Raises:
        OtherProgram: this worker, which may have joined late, is not what was expected.
    """
    if found := difference(expected, program()):
        raise OtherProgram(found)
    with single_threaded():
        return function(*args, **kwargs)


def processor() -> str:
    """Return the kind of processor; kernels and products may differ in their last bits between kinds."""
    from llvmlite.binding import get_host_cpu_name  # type: ignore[import-untyped]

    return str(get_host_cpu_name())
