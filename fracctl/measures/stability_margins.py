"""Measures of the loop itself, from its frequency response: margins, sensitivity, noise."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats, positive
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
        sample_period: T_s > 0, dimensionless; the default is 10 s for a chief at 10 000 km.

    Raises:
        ArgumentError: T_s is not positive.
    """

    name = "noise_gain"
    columns = ("noise_gain",)

    def __init__(self, sample_period: float = SAMPLE_PERIOD) -> None:
        self.sample_period = positive("sample_period", sample_period)

    def of_loop(self, loop: ClosedLoop) -> dict[str, Floats]:
        """Return column ``noise_gain``, (b,)."""
        return {self.name: np.atleast_1d(noise_gain(loop, self.sample_period))}
