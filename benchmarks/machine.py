"""The machine: which it is, how busy it is, and one core of it."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from threadpoolctl import threadpool_info  # type: ignore[import-untyped]

PACKAGES = ("fracctl", "numpy", "scipy", "numba", "pycaputo", "nilt-python", "pymittagleffler", "jitcdde", "mpmath")


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process on the last of its cores meanwhile, where the system allows it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def load() -> float:
    """Return the mean number of running processes over the last minute, NaN where the system does not tell."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")


def description() -> dict[str, str]:
    """Return processor, system, BLAS with its kernel, and versions of packages."""
    blas = [
        f"{info['internal_api']} {info['version']} ({info['architecture']}, {info['num_threads']} thread)"
        for info in threadpool_info()
        if info["user_api"] == "blas"
    ]
    found = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "blas": ", ".join(dict.fromkeys(blas)),
    }
    return found | {name: _version(name) for name in PACKAGES}


def _processor() -> str:
    table = Path("/proc/cpuinfo")
    lines = table.read_text(encoding="utf-8").splitlines() if table.exists() else []
    fields = {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
    if "model name" not in fields:
        return platform.processor() or platform.machine()
    return f"{fields['model name']}, family {fields.get('cpu family', '?')}, model {fields.get('model', '?')}"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
