"""Measures of linear loops, taken of sampled flights: the same columns in the same units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from fracctl.arrays import Floats
from fracctl.measures.fuel import DeltaV, PeakForce, PeakThrust, Propellant, StationKeeping, force_n, propellant_kg
from fracctl.measures.hold_error import HoldError
from fracctl.measures.in_units import TURN
from fracctl.measures.settling_times import SettlingTimes
from fracctl.sampled import SampledTrajectory, delta_v, final_rms, settling_times

Columns = dict[str, Floats]


def takes(measure: Any) -> bool:
    """Return whether a measure, or a class of them, can be taken of sampled flights."""
    return (measure if isinstance(measure, type) else type(measure)) in _MEASURED


def names() -> list[str]:
    """Names of the measures that can."""
    return [kind.name for kind in _MEASURED]


def columns_of(measure: Any, flight: SampledTrajectory, mass_kg: Floats | None = None) -> Columns:
    """Return the columns of a measure for a batch of flights, (b,) each; +inf for those that diverged.

    Args:
        measure: of a kind in `names`.
        flight: all of them.
        mass_kg: of every flight, (b,); None for that of the measure's spacecraft.
    """
    columns = _MEASURED[type(measure)](measure, flight)
    if mass_kg is not None and isinstance(measure, PeakForce | Propellant):  # both are in proportion to it
        share = mass_kg / np.asarray(measure.spacecraft.mass_kg, dtype=np.float64)
        columns = {name: values * share for name, values in columns.items()}
    gone = flight.status != "ok"
    return {name: np.where(gone, np.inf, values) for name, values in columns.items()}


def _settling(measure: SettlingTimes, flight: SampledTrajectory) -> Columns:
    bands = [band / measure.scales.length_m for band in measure.thresholds_m]
    return measure.in_all_units(settling_times(flight, bands).T)


def _delta_v(measure: DeltaV, flight: SampledTrajectory) -> Columns:
    speed = measure.scales.speed_m_s
    by_axis, together = (np.asarray(delta_v(flight, by=by)) for by in ("axis", "norm"))
    return dict(zip(measure.columns, (speed * by_axis, speed * together), strict=True))


def _station_keeping(measure: StationKeeping, flight: SampledTrajectory) -> Columns:
    count = _periods_in_orbit(flight)
    spent = np.abs(flight.commands[:, -count:]).sum(axis=(1, 2)) * flight.period
    return {measure.columns[0]: 1e3 * measure.scales.speed_m_s * spent * TURN / (count * flight.period)}


def _peak_thrust(measure: PeakThrust, flight: SampledTrajectory) -> Columns:
    return {measure.columns[0]: 1e3 * measure.scales.acceleration_m_s2 * np.abs(flight.commands).max(axis=(1, 2))}


def _peak_force(measure: PeakForce, flight: SampledTrajectory) -> Columns:
    peak = np.abs(flight.commands).max(axis=(1, 2)) * measure.scales.acceleration_m_s2
    return {measure.columns[0]: force_n(measure.spacecraft, peak)}


def _propellant(measure: Propellant, flight: SampledTrajectory) -> Columns:
    spent = np.asarray(delta_v(flight)) * measure.scales.speed_m_s
    return {measure.columns[0]: propellant_kg(measure.spacecraft, spent)}


def _hold_error(measure: HoldError, flight: SampledTrajectory) -> Columns:
    position, _ = final_rms(flight, _periods_in_orbit(flight) * flight.period)
    return {measure.columns[0]: measure.scales.length_m * np.linalg.norm(position, axis=1)}


def _periods_in_orbit(flight: SampledTrajectory) -> int:
    return max(1, min(round(TURN / flight.period), len(flight.times) - 1))


_MEASURED: Mapping[Any, Callable[[Any, SampledTrajectory], Columns]] = {
    SettlingTimes: _settling,
    DeltaV: _delta_v,
    StationKeeping: _station_keeping,
    PeakThrust: _peak_thrust,
    PeakForce: _peak_force,
    Propellant: _propellant,
    HoldError: _hold_error,
}
