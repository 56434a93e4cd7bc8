"""Measures of the loop itself, from its frequency response: margins, sensitivity, noise."""

from __future__ import annotations

from typing import Any

import numpy as np

from fracctl.arrays import Floats, positive
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop
from fracctl.stability import margins, noise_gain
from fracctl.stability.noise import SAMPLE_PERIOD


class StabilityMargins:
    """Gain, phase and delay that bring a pole to the imaginary axis, of a loop with one control.

    See `fracctl.stability.margins`. NaN for a loop that is not stable, inf where nothing of the kind brings it there.
    """

    name = "stability_margins"
    columns = ("gain_margin_db", "gain_reduction_db", "phase_margin_deg", "delay_margin", "delay_margin_s")
    most_controls = 1

    def of_loop(self, loop: ClosedLoop) -> dict[str, Floats]:
        """Return the columns, (b,) each."""
        found = margins(loop)
        return {column: np.atleast_1d(getattr(found, column)) for column in self.columns}


class Sensitivity:
    """Peaks of |S| and |T|, and the disk margin with the gain and the phase that it guarantees, for any controls.

    See `fracctl.stability.margins`. NaN for a loop that is not stable.
    """

    name = "sensitivity"
    columns = (
        "sensitivity_peak",
        "complementary_peak",
        "disk_margin",
        "disk_gain_margin_db",
        "disk_phase_margin_deg",
    )

    def of_loop(self, loop: ClosedLoop) -> dict[str, Floats]:
        """Return the columns, (b,) each."""
        found = margins(loop)
        return {column: np.atleast_1d(getattr(found, column)) for column in self.columns}


class NoiseGain:
    """Rms of the control for white noise of unit rms in every position, up to the Nyquist frequency of sampling.

    See `fracctl.stability.noise_gain`. NaN for a loop that is not stable.

    Args:
        sample_period: T_s > 0, dimensionless; 10 s for a chief at 10 000 km where neither is given.
        sample_period_s: T_s in seconds, for plants with scales.

    Raises:
        ArgumentError: T_s is not positive, or given twice.
    """

    name = "noise_gain"
    columns = ("noise_gain",)

    def __init__(self, sample_period: float | None = None, sample_period_s: float | None = None) -> None:
        for name, value in (("sample_period", sample_period), ("sample_period_s", sample_period_s)):
            if value is not None:
                positive(name, value)
        if sample_period is not None and sample_period_s is not None:
            raise ArgumentError("sample_period_s", sample_period_s, "must not be given beside sample_period")
        self.sample_period, self.sample_period_s = sample_period, sample_period_s

    def for_flight(self, plant: Any, craft: Any = None) -> NoiseGain:  # noqa: ARG002 - as measures with units have it
        """Return the measure with its period in the unit of a plant.

        Raises:
            ArgumentError: the period is in seconds, and the plant has no units.
        """
        if self.sample_period_s is None:
            return self
        if plant.scales is None:
            raise ArgumentError("sample_period_s", self.sample_period_s, "needs a plant with units; give sample_period")
        return NoiseGain(self.sample_period_s / plant.scales.time_s)

    def of_loop(self, loop: ClosedLoop) -> dict[str, Floats]:
        """Return column ``noise_gain``, (b,)."""
        period = self.for_flight(loop.plant).sample_period
        return {self.name: np.atleast_1d(noise_gain(loop, SAMPLE_PERIOD if period is None else period))}
