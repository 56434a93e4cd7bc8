"""Laws as they run on board: sampled, with a memory of fixed length, limited, noisy, and exported."""

from __future__ import annotations

from fracctl.sampled.actuator import Actuator
from fracctl.sampled.comparison import Implementation, compare
from fracctl.sampled.controller import DiscreteController
from fracctl.sampled.exponentials import Exponentials
from fracctl.sampled.export import ExportedController, export
from fracctl.sampled.law import SampledLaw, dimensionless_time
from fracctl.sampled.margins import noise_rms, sampled_margins
from fracctl.sampled.measures import delta_v, final_rms, peak_control, settling_times
from fracctl.sampled.navigation import Navigation
from fracctl.sampled.operators import Memory
from fracctl.sampled.oustaloup import Oustaloup
from fracctl.sampled.simulation import simulate
from fracctl.sampled.tolerance import choose_memory, loop_band, memory_for, memory_orders, response_error
from fracctl.sampled.trajectory import SampledTrajectory
from fracctl.sampled.window import Window

__all__ = [
    "Actuator",
    "DiscreteController",
    "Exponentials",
    "ExportedController",
    "Implementation",
    "Memory",
    "Navigation",
    "Oustaloup",
    "SampledLaw",
    "SampledTrajectory",
    "Window",
    "choose_memory",
    "compare",
    "delta_v",
    "dimensionless_time",
    "export",
    "final_rms",
    "loop_band",
    "memory_for",
    "memory_orders",
    "noise_rms",
    "peak_control",
    "response_error",
    "sampled_margins",
    "settling_times",
    "simulate",
]
