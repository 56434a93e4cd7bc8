"""The name of a run: a hash of all that changes its numbers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, entry_points, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parents[1]

NOT_IN_IDENTITY = ("scheduler", "figures", "output_dir")
"""Keys of the configuration that change no number."""

DECISIVE = ("numpy", "scipy", "numba", "llvmlite", "pymoo", "moocore")
"""Packages whose versions change numbers."""

_KINDS = ("plants", "controllers", "solvers", "measures", "surveys")
_LENGTH = 12


def run_id(configuration: Mapping[str, Any], sources: str | None = None) -> str:
    """Return the run's id, 12 hexadecimal digits.

    Args:
        configuration: plain data, resolved, the seed included.
        sources: digest of the program; default: that of the package's sources.
    """
    several_laws = configuration.get("evaluation", {}).get("laws")
    idle = {*NOT_IN_IDENTITY, "controller"} if several_laws else {*NOT_IN_IDENTITY}
    configuration = {key: value for key, value in configuration.items() if key not in idle}
    what = {
        "configuration": configuration,
        "sources": sources_digest() if sources is None else sources,
        "versions": {name: version_of(name) for name in DECISIVE},
    }
    if others := extensions(configuration):
        what["extensions"] = others
    return hashlib.sha256(canonical_json(what).encode()).hexdigest()[:_LENGTH]


def canonical_json(data: Any) -> str:
    """Return JSON that is equal for equal data: keys sorted, no blanks."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def extensions(configuration: Mapping[str, Any]) -> dict[str, str]:
    """Return the digests of the installed packages, by name, from which a run has its plant, laws or measures."""
    named = {*_types(configuration), *configuration.get("measures", {})}
    packages = {module.partition(".")[0] for name, module in _entry_points() if name in named}
    return {package: package_digest(package) for package in sorted(packages)}


def version_of(name: str) -> str | None:
    """Return the version of an installed package, None where there is none."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _types(data: Any) -> Iterator[str]:
    """Yield what stands behind the keys `type`, at any depth."""
    for key, value in data.items() if isinstance(data, Mapping) else ():
        if key == "type":
            yield str(value)
        else:
            yield from _types(value)


@cache
def _entry_points() -> tuple[tuple[str, str], ...]:
    """Name and module of everything that other packages offer and that changes numbers."""
    found = [entry_points(group=f"fracctl.{kind}") for kind in _KINDS]
    return tuple((entry.name, entry.module) for group in found for entry in group)


@cache
def package_digest(package: str) -> str:
    """Return the digest of an installed package's Python sources, empty where it is not installed."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return ""
    origin = Path(spec.origin)
    return sources_digest(origin.parent) if spec.submodule_search_locations else _digest([origin], origin.parent)


@cache
def sources_digest(package: Path = PACKAGE) -> str:
    """Return the SHA-256 over names and contents of a package's Python sources."""
    return _digest(sorted(package.rglob("*.py")), package)


def _digest(paths: Iterable[Path], package: Path) -> str:
    digest = hashlib.sha256()
    for path in paths:
        content = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()
