"""Gains from a model of the plant."""

from fracctl.design.law import LQR
from fracctl.design.lqr import gains_by_name, lqr

__all__ = ["LQR", "gains_by_name", "lqr"]
