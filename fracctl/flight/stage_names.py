"""The stages of a law on its way to a flight."""

from __future__ import annotations

from typing import Literal

Stage = Literal["ideal", "sampled", "noisy", "nonlinear", "dispersed"]
STAGES: tuple[Stage, ...] = ("ideal", "sampled", "noisy", "nonlinear", "dispersed")
"""In the order of what they add."""
CERTAIN: tuple[Stage, ...] = ("ideal", "sampled")
"""Stages in which nothing is random."""
