"""Verdicts on stability, and how far loops are from losing it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use
from fracctl.stability.assess import Verdict, assess
from fracctl.stability.margins import Margins, margins
from fracctl.stability.matignon import PseudoStateVerdict, matignon
from fracctl.stability.noise import noise_gain

if TYPE_CHECKING:
    from fracctl.stability.families import FamilyMember, family, shoot_on_section
    from fracctl.stability.floquet import Neighbourhood, multipliers, nontrivial_multipliers, real_above_one, residual
    from fracctl.stability.lyapunov import largest_exponent
    from fracctl.stability.modal_floquet import MemoryMultipliers, memory_multipliers
    from fracctl.stability.periodic_orbits import PeriodicOrbit, shoot

__all__ = [
    "FamilyMember",
    "Margins",
    "MemoryMultipliers",
    "Neighbourhood",
    "PeriodicOrbit",
    "PseudoStateVerdict",
    "Verdict",
    "assess",
    "family",
    "largest_exponent",
    "margins",
    "matignon",
    "memory_multipliers",
    "multipliers",
    "noise_gain",
    "nontrivial_multipliers",
    "real_above_one",
    "residual",
    "shoot",
    "shoot_on_section",
]

__getattr__ = loaded_at_first_use(
    __name__,
    {
        "FamilyMember": "families",
        "Neighbourhood": "floquet",
        "family": "families",
        "shoot_on_section": "families",
        "MemoryMultipliers": "modal_floquet",
        "memory_multipliers": "modal_floquet",
        "PeriodicOrbit": "periodic_orbits",
        "shoot": "periodic_orbits",
        "largest_exponent": "lyapunov",
        "multipliers": "floquet",
        "nontrivial_multipliers": "floquet",
        "real_above_one": "floquet",
        "residual": "floquet",
    },
)
