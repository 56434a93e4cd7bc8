"""What runs in a worker of a Dask cluster, and what such a worker must be to give the bits that this process gives."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from threadpoolctl import threadpool_info  # type: ignore[import-untyped]

from fracctl.execution.threads import single_threaded
from fracctl.store.identity import sources_digest

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


def identify() -> tuple[dict[str, str], str]:
    """Return `program`, and the kinds of processor that the linear algebra libraries were loaded for."""
    kinds = {str(library["architecture"]) for library in threadpool_info() if library.get("architecture")}
    return program(), ", ".join(sorted(kinds))


def packed(function: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]) -> bytes:
    """Return a call of an importable function as `answer` takes it."""
    return pickle.dumps((program(), pickle.dumps((function, args, kwargs), pickle.HIGHEST_PROTOCOL)))


def answer(request: bytes) -> bytes:
    """Do a packed call, with one thread in the linear algebra libraries, and return its pickled result.

    Dask would ask for a result that cannot be sent again and again.

    Raises:
        OtherProgram: this worker, which may have joined late, is not what the call was packed for.
    """
    expected, content = pickle.loads(request)
    if found := difference(expected, program()):
        raise OtherProgram(found)
    function, args, kwargs = pickle.loads(content)
    with single_threaded():
        result = function(*args, **kwargs)
    return pickle.dumps(result, pickle.HIGHEST_PROTOCOL)


_THIS = "__import__('fracctl.execution.dask_call', fromlist=['answer'])"
IDENTIFY = f"{_THIS}.identify()"
"""What Dask has a worker evaluate. Plain text: scheduler and workers that lack fracctl must get it in their hands, for
they end at a message that they cannot read."""
ANSWER = f"{_THIS}.answer(request)"
"""The same, where `request` is a packed call."""
