"""The problems that laws are compared on, a settling band and a limit for each start, and what tells rows apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LAW, PART, LIMIT = "law", "part", "limit"
KEYS = (LAW, PART, LIMIT, "limit_value", "threshold_m", "start", "horizon_periods")
"""Columns that say what a row is: a law, which part of the study, the problem, the start, the horizon."""
OPEN_LOOP = "open_loop"
"""The law of rows that bound all laws."""
GAIN, PEAK = "gain", "peak"
MOST_GRID_VARIABLES = 3
"""Laws with more parameters have no grid."""


def objective_within(threshold_m: float) -> str:
    """Name of the objective with a settling band of δ metres, e.g. ``within_100_m``."""
    return f"within_{threshold_m:g}_m"


def settling_time_within(threshold_m: float) -> str:
    """Column of the settling time to δ metres, e.g. ``settling_time_within_100_m``."""
    return f"settling_time_{objective_within(threshold_m)}"


@dataclass(frozen=True)
class Problem:
    """Every law is optimised anew for each of them."""

    threshold_m: float
    """Half width δ of the settling band in metres."""
    limit: Literal["gain", "peak"]
    """What is limited: the gains themselves, or the peak acceleration with wide bounds on the gains."""
    value: float
    """Largest gain, or peak acceleration in mm/s²."""

    @property
    def objective(self) -> str:
        """Name of the objective."""
        return objective_within(self.threshold_m)

    def __str__(self) -> str:
        """E.g. ``within_100_m/peak/8``."""
        return f"{self.objective}/{self.limit}/{self.value:g}"
