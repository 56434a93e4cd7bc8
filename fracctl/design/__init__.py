"""Gains and delays from a model of the plant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.design.law import LQR
from fracctl.design.lqr import gains_by_name, lqr
from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.design.delayed_lqr import DelayedLQR
    from fracctl.design.delays import first_return, natural_period
    from fracctl.design.multiplier_minimisation import ROTATIONS, minimise_largest_multiplier
    from fracctl.design.state_regulators import forward_blow_up, lqr_at, periodic_regulator
    from fracctl.design.windowed_regulator import WindowedRegulator

__all__ = [
    "LQR",
    "ROTATIONS",
    "DelayedLQR",
    "WindowedRegulator",
    "first_return",
    "forward_blow_up",
    "gains_by_name",
    "lqr",
    "lqr_at",
    "minimise_largest_multiplier",
    "natural_period",
    "periodic_regulator",
]

__getattr__ = loaded_at_first_use(
    __name__,
    {
        "first_return": "delays",
        "natural_period": "delays",
        "DelayedLQR": "delayed_lqr",
        "ROTATIONS": "multiplier_minimisation",
        "WindowedRegulator": "windowed_regulator",
        "forward_blow_up": "state_regulators",
        "lqr_at": "state_regulators",
        "minimise_largest_multiplier": "multiplier_minimisation",
        "periodic_regulator": "state_regulators",
    },
)
