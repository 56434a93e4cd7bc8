"""Laws on their way to a flight: ideal, sampled, noisy and limited, on nonlinear motion, dispersed."""

from __future__ import annotations

from fracctl.flight.conclusion import QUANTILES, SURVIVAL
from fracctl.flight.evaluation import FlightEvaluation
from fracctl.flight.robust import RobustEvaluation
from fracctl.flight.stages import ADDS, STAGES, Sampling, Stage, Surroundings

__all__ = [
    "ADDS",
    "QUANTILES",
    "STAGES",
    "SURVIVAL",
    "FlightEvaluation",
    "RobustEvaluation",
    "Sampling",
    "Stage",
    "Surroundings",
]
