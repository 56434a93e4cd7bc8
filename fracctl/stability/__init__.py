"""Verdicts on stability."""

from fracctl.stability.assess import Verdict, assess
from fracctl.stability.matignon import PseudoStateVerdict, matignon

__all__ = ["PseudoStateVerdict", "Verdict", "assess", "matignon"]
