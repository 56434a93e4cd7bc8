"""The name of a run: a hash of all that changes its numbers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parents[1]

NOT_IN_IDENTITY = ("scheduler", "figures", "output_dir")
"""Keys of the configuration that change no number."""

VERSIONS = ("numpy", "scipy")
"""Packages whose versions change numbers."""

_LENGTH = 12


def run_id(configuration: Mapping[str, Any], sources: str | None = None) -> str:
    """Return the run's id, 12 hexadecimal digits.

    Args:
        configuration: plain data, resolved, the seed included.
        sources: digest of the program; default: that of the package's sources.
    """
    what = {
        "configuration": {key: value for key, value in configuration.items() if key not in NOT_IN_IDENTITY},
        "sources": sources_digest() if sources is None else sources,
        "versions": {name: version(name) for name in VERSIONS},
    }
    return hashlib.sha256(canonical_json(what).encode()).hexdigest()[:_LENGTH]


def canonical_json(data: Any) -> str:
    """Return JSON that is equal for equal data: keys sorted, no blanks."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


@cache
def sources_digest(package: Path = PACKAGE) -> str:
    """Return the SHA-256 over names and contents of a package's Python sources."""
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()
