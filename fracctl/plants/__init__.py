"""Plants: what is controlled, with its component names and scales."""

from fracctl.plants.hcw import HCW, Chief, HCWInPlane, HCWOutOfPlane
from fracctl.plants.linear import LinearPlant

__all__ = ["HCW", "Chief", "HCWInPlane", "HCWOutOfPlane", "LinearPlant"]
