"""What runs in a worker of a Dask cluster, and what such a worker must be to give the bits that this process gives."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

from threadpoolctl import threadpool_info  # type: ignore[import-untyped]

from fracctl.execution.threads import single_threaded
from fracctl.execution.worker import Work
from fracctl.store.identity import DECISIVE, extensions, package_digest, sources_digest, version_of

Program = Mapping[str, str]
"""Versions by name, and the digests of the sources of fracctl and of packages that extend it."""
_SOURCES = "sources of "


class OtherProgram(Exception):
    """A worker has other versions than the process that the survey runs in."""


def program(packages: Iterable[str] = ()) -> dict[str, str]:
    """Return what decides on the bits of a result in this process; of extensions, those that are named count."""
    return {**_own(), **{f"{_SOURCES}{package}": package_digest(package) for package in packages}}


@cache
def _own() -> Program:
    versions = {name: version_of(name) or "an unknown version" for name in ("fracctl", *DECISIVE)}
    return versions | {f"{_SOURCES}fracctl": sources_digest()}


def difference(here: Program, there: Program) -> str | None:
    """Return in words how another process differs from this one; None if it gives the same bits."""
    for name, own in here.items():
        if own != there.get(name):
            package = name.removeprefix(_SOURCES)
            version = f" {here[package]}" if package in here else ""
            of_sources = f"other sources of {package}{version}" if there.get(name) else f"no package {package}"
            return of_sources if name.startswith(_SOURCES) else f"{name} {there.get(name)} instead of {own}"
    return None


@lru_cache(maxsize=4)
def _extensions(work: Work) -> tuple[str, ...]:
    """Names of the packages from which an evaluation has its parts."""
    data = json.loads(work.data)
    return tuple(extensions(data)) if isinstance(data, dict) else ()


def identify() -> tuple[dict[str, str], str]:
    """Return `program`, and the kinds of processor that the linear algebra libraries were loaded for."""
    kinds = {str(library["architecture"]) for library in threadpool_info() if library.get("architecture")}
    return program(), ", ".join(sorted(kinds))


def packed(function: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]) -> bytes:
    """Return a call of an importable function as `answer` takes it."""
    used = [package for arg in args if isinstance(arg, Work) for package in _extensions(arg)]
    return pickle.dumps((program(used), pickle.dumps((function, args, kwargs), pickle.HIGHEST_PROTOCOL)))


def answer(request: bytes) -> bytes:
    """Do a packed call, with one thread in the linear algebra libraries, and return its pickled result.

    Dask would ask for a result that cannot be sent again and again.

    Raises:
        OtherProgram: this worker, which may have joined late, is not what the call was packed for.
    """
    expected, content = pickle.loads(request)
    named = [name.removeprefix(_SOURCES) for name in expected if name.startswith(_SOURCES)]
    if found := difference(expected, program(name for name in named if name != "fracctl")):
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
