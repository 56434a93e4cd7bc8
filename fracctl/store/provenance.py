"""Where a run comes from: versions, commit, machine."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Mapping
from typing import Any

from fracctl.store.identity import DECISIVE, PACKAGE, extensions, package_digest, sources_digest, version_of

_LIBRARIES = ("fracctl", *DECISIVE, "pandas", "pyarrow")


def provenance(configuration: Mapping[str, Any]) -> dict[str, Any]:
    """Return what does not change while the run is computed, as plain data."""
    return {
        "versions": {"python": platform.python_version()} | {name: version_of(name) for name in _LIBRARIES},
        "commit": _commit(),
        "sources": sources_digest(),
        "extensions": extensions(configuration),
        "platform": platform.platform(),
        "processor": platform.machine(),
        "cores": os.cpu_count(),
        "seed": configuration.get("seed"),
    }


def differences(before: Mapping[str, Any]) -> list[str]:
    """Return what of `before`, which decides on a run's id, is not as it is now, e.g. ``numpy 2.1.0, now 2.2.0``."""
    versions = before.get("versions", {})
    found = [
        f"{name} {versions.get(name)}, now {version_of(name)}"
        for name in DECISIVE
        if versions.get(name) != version_of(name)
    ]
    if before.get("sources") != sources_digest():
        commit = f" (commit {before['commit']})" if before.get("commit") else ""
        found.append(f"other sources of fracctl {versions.get('fracctl')}{commit}")
    given = before.get("extensions", {})
    return found + [f"other sources of {name}" for name, digest in given.items() if digest != package_digest(name)]


def _commit() -> str | None:
    """Commit of the checkout that the package lies in, with ``-dirty`` where files differ from it."""
    if not (PACKAGE.parent / ".git").exists():
        return None
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, cwd=PACKAGE.parent, capture_output=True, text=True, timeout=5, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None
