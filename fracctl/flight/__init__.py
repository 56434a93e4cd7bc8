"""Laws on their way to a flight: ideal, sampled, noisy and limited, on nonlinear motion, dispersed.

What flies is loaded at first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.flight.stage_names import STAGES, Stage
from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.flight.conclusion import QUANTILES, SURVIVAL
    from fracctl.flight.evaluation import FlightEvaluation
    from fracctl.flight.robust import RobustEvaluation
    from fracctl.flight.stages import Sampling, Surroundings

__all__ = [
    "QUANTILES",
    "STAGES",
    "SURVIVAL",
    "FlightEvaluation",
    "RobustEvaluation",
    "Sampling",
    "Stage",
    "Surroundings",
]


__getattr__ = loaded_at_first_use(
    __name__,
    {
        "QUANTILES": "conclusion",
        "SURVIVAL": "conclusion",
        "FlightEvaluation": "evaluation",
        "RobustEvaluation": "robust",
        "Sampling": "stages",
        "Surroundings": "stages",
    },
)
