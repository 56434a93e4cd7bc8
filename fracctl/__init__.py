"""Fractional-order control of relative orbital motion: certified solves, surveys, stored runs, figures.

    import fracctl as fc
    loop = fc.ClosedLoop(fc.plants.HCWOutOfPlane(), fc.controllers.PDAlpha(k_p=0.85, k_d=2.0, alpha=0.91))
    trajectory = fc.solve(loop, initial_state=[0.0, 0.002], horizon=12 * np.pi)

Names are loaded at first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fracctl import controllers, design, measures, plants, sampled, solvers, stability
    from fracctl.execution.library import run
    from fracctl.loop import ClosedLoop
    from fracctl.solvers import solve

    __version__: str

__all__ = [
    "ClosedLoop",
    "__version__",
    "controllers",
    "design",
    "measures",
    "plants",
    "run",
    "sampled",
    "solve",
    "solvers",
    "stability",
]

_ROOMS = ("controllers", "design", "measures", "plants", "sampled", "solvers", "stability")
_OBJECTS = {"ClosedLoop": "fracctl.loop", "run": "fracctl.execution.library", "solve": "fracctl.solvers"}


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return import_module(f"fracctl.{name}")
    if name in _OBJECTS:
        return getattr(import_module(_OBJECTS[name]), name)
    if name == "__version__":
        return _version()
    raise AttributeError(f"module 'fracctl' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("fracctl")
    except PackageNotFoundError:
        return "0+unknown"
