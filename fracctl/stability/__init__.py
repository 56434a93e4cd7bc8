"""Verdicts on stability."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fracctl.stability.assess import Verdict, assess
from fracctl.stability.matignon import PseudoStateVerdict, matignon

if TYPE_CHECKING:
    from fracctl.stability.floquet import multipliers, real_above_one, residual
    from fracctl.stability.periodic_orbits import PeriodicOrbit, shoot

__all__ = [
    "PeriodicOrbit",
    "PseudoStateVerdict",
    "Verdict",
    "assess",
    "matignon",
    "multipliers",
    "real_above_one",
    "residual",
    "shoot",
]

_ORBITS = {
    "PeriodicOrbit": "periodic_orbits",
    "shoot": "periodic_orbits",
    "multipliers": "floquet",
    "real_above_one": "floquet",
    "residual": "floquet",
}
"""Names that are loaded at first use, with their compiled kernels."""


def __getattr__(name: str) -> Any:
    if name in _ORBITS:
        return getattr(import_module(f"fracctl.stability.{_ORBITS[name]}"), name)
    raise AttributeError(f"module 'fracctl.stability' has no attribute '{name}'")
