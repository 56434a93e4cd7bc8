"""Rows of flights: what is measured of a batch, and the word with which it ends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Array
from fracctl.evaluation import COUNTERS
from fracctl.flight.conclusion import settling_column
from fracctl.flight.measured import columns_of
from fracctl.flight.stages import Flown
from fracctl.measures.in_units import TURN
from fracctl.measures.settling_times import SettlingTimes, column_of
from fracctl.sampled import SampledTrajectory
from fracctl.trajectory import Trajectory

LIMITED = "limited_percent"
"""Column of the share of periods in which the thrusters were at their limit."""
KEPT = 0.5 * TURN
"""How long a band must have been kept at the horizon, at most half of it: noise is inside a narrow one by chance."""
Rows = dict[str, Array]


def of_ideal(found: Trajectory, measures: Iterable[Any], band_m: float) -> Rows:
    """Return the rows of ideal flights, judged by a band."""
    rows: Rows = {}
    for measure in measures:
        rows |= _kept(measure, measure(found), found.horizon)
    rows |= {LIMITED: np.zeros(len(found.status)), "status": _told(found.status, rows, band_m)}
    rows |= {"stable": found.stable, "error_estimate": found.error_estimate}
    return rows | {name: found.counters[name] for name in COUNTERS}


def of_sampled(flight: SampledTrajectory, met: Flown, measures: Iterable[Any], band_m: float) -> Rows:
    """Return the rows of sampled flights, judged by a band."""
    rows: Rows = {}
    for measure in measures:
        rows |= _kept(measure, columns_of(measure, flight, met.mass_kg), flight.horizon)
    b, periods = flight.commands.shape[:2]
    rows |= {LIMITED: 100.0 * flight.saturated_share, "status": _told(flight.status, rows, band_m)}
    rows |= {"stable": np.full(b, None, dtype=object), "error_estimate": np.full(b, np.nan)}
    return rows | dict.fromkeys(COUNTERS, np.full(b, periods))


def of_none(count: int, columns: Sequence[str], word: str) -> Rows:
    """Return the rows of flights that are not flown, ``unstable`` or ``failed``."""
    rows: Rows = {name: np.full(count, np.inf) for name in columns}
    rows |= {LIMITED: np.full(count, np.nan), "status": np.full(count, word, dtype=object)}
    stable = np.full(count, False if word == "unstable" else None, dtype=object)
    rows |= {"stable": stable, "error_estimate": np.full(count, np.nan)}
    return rows | dict.fromkeys(COUNTERS, np.zeros(count, dtype=np.int64))


def _kept(measure: Any, columns: Rows, horizon: float) -> Rows:
    """Return columns of a measure; a band counts as settled in only if it was kept long enough up to the horizon."""
    if not isinstance(measure, SettlingTimes):
        return columns
    latest = horizon - min(KEPT, 0.5 * horizon)
    names = [column_of(band) for band in measure.thresholds_m]
    return measure.in_all_units([np.where(columns[name] > latest, np.inf, columns[name]) for name in names])


def _told(status: Array, rows: Mapping[str, Array], band_m: float) -> Array:
    told = status.copy()
    told[(told == "ok") & ~np.isfinite(rows[settling_column(band_m)])] = "unsettled"
    return told
