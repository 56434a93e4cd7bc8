"""What survives: flights of every law from every start, stage by stage."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.dispersions import SAMPLE, share_interval, spread, spreads
from fracctl.evaluation import Conclusion
from fracctl.flight.stage_names import STAGES
from fracctl.measures.settling_times import column_of

QUANTILES, SURVIVAL = "quantiles", "survival"
"""Names of the tables."""
_DELTA_V, _STATION_KEEPING, _HOLD = "delta_v_m_s", "station_keeping_mm_s_per_orbit", "hold_error_m"
Record = dict[str, Any]


def conclude(
    rows: Mapping[str, Array], groups: Sequence[str], measures: Sequence[str], bands_m: Mapping[str, float]
) -> Conclusion:
    """Return quantiles of all measures, the table of what survives, and a sentence for each start.

    Args:
        rows: of the run.
        groups: columns that tell laws and starts apart, the start first.
        measures: columns of measures.
        bands_m: the band by which flights are judged, by start.
    """
    records = list(survival(rows, groups, bands_m))
    quantiles = list(spreads(rows, [*groups, "stage"], measures))
    notes = [note for condition in bands_m for note in _sentences(records, groups, condition)]
    return Conclusion({QUANTILES: quantiles, SURVIVAL: records}, {SURVIVAL: records}, (*notes, *_endings(rows)))


def survival(rows: Mapping[str, Array], groups: Sequence[str], bands_m: Mapping[str, float]) -> Iterator[Record]:
    """Yield a record for each law, start and stage: how many flights settle, when, and what that takes."""
    keys = list(zip(*(rows[name].tolist() for name in groups), rows["stage"].tolist(), strict=True))
    for key in dict.fromkeys(keys):
        places = np.array([place for place, other in enumerate(keys) if other == key])
        record: Record = dict(zip([*groups, "stage"], key, strict=True))
        band = bands_m[str(key[0])]
        samples, times = rows[SAMPLE][places], np.asarray(rows[settling_column(band)], dtype=np.float64)[places]
        found = spread(samples, times)
        record |= {"band_m": band, "samples": len(places)} | _settled(np.isfinite(times))
        record |= {"median_orbits": found["median"], "quantile_95_orbits": found["quantile_95"]}
        record |= {f"quantile_95_{end}_orbits": found[f"quantile_95_{end}"] for end in ("low", "high")}
        record |= {"worst_sample": _worst(rows, places, times)}
        for measure in (_DELTA_V, _STATION_KEEPING, _HOLD):
            if measure in rows:
                of_all = spread(samples, np.asarray(rows[measure], dtype=np.float64)[places])
                record |= {f"{word}_{measure}": of_all[word] for word in ("median", "quantile_95")}
        yield record | {"limited_percent": float(rows["limited_percent"][places].mean())}


def _settled(inside: Booleans) -> Record:
    """Return the share of flights that settle, with its interval."""
    low, high = share_interval(int(inside.sum()), len(inside))
    shares = {"": float(inside.mean()), "_low": low, "_high": high}
    return {f"settled_percent{end}": 100.0 * share for end, share in shares.items()}


def _worst(rows: Mapping[str, Array], places: Array, times: Floats) -> float:
    """Return the sample that settles last; of those that never do the one that is held worst."""
    held = np.asarray(rows[_HOLD], dtype=np.float64)[places] if _HOLD in rows else np.zeros(len(places))
    return float(rows[SAMPLE][places][np.lexsort((held, times))[-1]])


def settling_column(band_m: float) -> str:
    """Return the column of the settling time to a band, in orbits."""
    return f"{column_of(band_m)}_orbits"


def _sentences(records: Sequence[Record], groups: Sequence[str], condition: str) -> Iterator[str]:
    """Yield which law is fastest at the first stage and at the last."""
    own = [record for record in records if record["initial_condition"] == condition]
    stages = [stage for stage in STAGES if any(record["stage"] == stage for record in own)]
    if len(stages) < 2 or len({_name(record, groups) for record in own}) < 2:
        return
    words = []
    for stage, column in ((stages[0], "median_orbits"), (stages[-1], "quantile_95_orbits")):
        there = [record for record in own if record["stage"] == stage]
        best = min(there, key=lambda record: record[column])
        share = f" in 95 % of {best['samples']} flights" if best["samples"] > 1 else ""
        if math.isinf(best[column]):
            words.append(f"no law settles {stage}{share}")
        else:
            words.append(f"fastest {stage}: {_name(best, groups)} ({best[column]:.3f} orbits{share})")
    yield f"{condition} to {own[0]['band_m']:g} m, {'; '.join(words)}"


def _name(record: Mapping[str, Any], groups: Sequence[str]) -> str:
    if "law" in record:
        return str(record["law"])
    return ", ".join(f"{name} = {record[name]:g}" for name in groups[1:]) or "the law"


def _endings(rows: Mapping[str, Array]) -> Iterator[str]:
    for word, meaning in _ENDINGS.items():
        if count := int((rows["status"] == word).sum()):
            yield f"{count} of {len(rows['status'])} flights {word}: {meaning}"


_ENDINGS = {
    "unstable": "the ideal loop is not stable, so none was flown",
    "diverged": "the states left the range of numbers",
    "failed": "the law cannot be sampled, or its loop is marginal and no memory can be chosen",
}
