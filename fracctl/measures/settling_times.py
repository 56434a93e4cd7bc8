"""Settling times to several bands in metres."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fracctl.arrays import Floats
from fracctl.measures.in_units import TURN, InUnits, checked_bands
from fracctl.measures.settling_time import SettlingTime
from fracctl.trajectory import Trajectory


class SettlingTimes(InUnits):
    """Last crossings of |ξ_i| = δ for several δ in metres, dimensionless, in minutes and in orbits.

    Columns ``settling_time_100_m``, ``settling_time_100_m_min``, ``settling_time_100_m_orbits`` for each δ; +inf where
    the band is left at the horizon, which does not make a row unsettled unless an objective holds the column.

    Args:
        thresholds_m: δ > 0, in metres.

    Raises:
        ArgumentError: a band is not positive, or given twice.
    """

    name = "settling_times"
    may_be_infinite = True

    def __init__(self, thresholds_m: Sequence[float] = (1000.0, 300.0, 100.0, 30.0, 10.0, 1.0)) -> None:
        self.thresholds_m = checked_bands(thresholds_m)
        plain = [column_of(band) for band in self.thresholds_m]
        self.columns = tuple(f"{column}{unit}" for unit in ("", "_min", "_orbits") for column in plain)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the columns, (b,) each."""
        bands = [SettlingTime(band / self.scales.length_m) for band in self.thresholds_m]
        return self.in_all_units([measure(trajectory)[measure.name] for measure in bands])

    def in_all_units(self, times: Iterable[Floats]) -> dict[str, Floats]:
        """Return the columns of dimensionless settling times to each band, (b,) each."""
        found = dict(zip(map(column_of, self.thresholds_m), times, strict=True))
        minutes = {f"{column}_min": self.scales.time_s / 60.0 * time for column, time in found.items()}
        return found | minutes | {f"{column}_orbits": time / TURN for column, time in found.items()}


def column_of(threshold_m: float) -> str:
    """Return the column of a band, e.g. ``settling_time_0_5_m``."""
    return f"settling_time_{threshold_m:g}_m".replace(".", "_").replace("-", "_").replace("+", "")
