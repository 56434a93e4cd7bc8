"""The stages of a law on its way to a flight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

Stage = Literal["ideal", "sampled", "noisy", "nonlinear", "dispersed"]
STAGES: tuple[Stage, ...] = ("ideal", "sampled", "noisy", "nonlinear", "dispersed")
"""In the order of what they add."""
ADDS: Mapping[Stage, str] = {
    "ideal": "the law itself on the linear plant",
    "sampled": "samples, hold, delay and a memory of fixed length",
    "noisy": "noise of the navigation, and thrusters with their limits",
    "nonlinear": "nonlinear motion",
    "dispersed": "starts, spacecraft, noise and orbits as they are drawn",
}
CERTAIN: tuple[Stage, ...] = ("ideal", "sampled")
"""Stages in which nothing is random."""
