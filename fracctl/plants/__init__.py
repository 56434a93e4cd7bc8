"""Plants: what is controlled, with its component names and scales.

Plants with compiled kernels are loaded at first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use
from fracctl.plants.function import FunctionPlant
from fracctl.plants.hcw import HCW, Chief, HCWInPlane, HCWOutOfPlane
from fracctl.plants.linear import LinearPlant
from fracctl.plants.state import Event, Section, StatePlant

if TYPE_CHECKING:
    from fracctl.plants.libration import Libration
    from fracctl.plants.perturbed_relative_motion import PerturbedRelativeMotion
    from fracctl.plants.relative_motion import RelativeMotion
    from fracctl.plants.rotating_ellipsoid import RotatingEllipsoid
    from fracctl.plants.tether import Tether
    from fracctl.plants.tschauner_hempel import TschaunerHempel

__all__ = [
    "HCW",
    "Chief",
    "Event",
    "FunctionPlant",
    "HCWInPlane",
    "HCWOutOfPlane",
    "Libration",
    "LinearPlant",
    "PerturbedRelativeMotion",
    "RelativeMotion",
    "RotatingEllipsoid",
    "Section",
    "StatePlant",
    "Tether",
    "TschaunerHempel",
]

__getattr__ = loaded_at_first_use(
    __name__,
    {
        "Libration": "libration",
        "PerturbedRelativeMotion": "perturbed_relative_motion",
        "RelativeMotion": "relative_motion",
        "RotatingEllipsoid": "rotating_ellipsoid",
        "Tether": "tether",
        "TschaunerHempel": "tschauner_hempel",
    },
)
