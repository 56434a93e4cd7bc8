"""What survives: flights of every law from every start, stage by stage."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Array
from fracctl.dispersions import SAMPLE, spread, spreads
from fracctl.evaluation import Conclusion
from fracctl.flight.names import STAGES
from fracctl.measures.settling_times import column_of

QUANTILES, SURVIVAL = "quantiles", "survival"
"""Names of the tables."""
_DELTA_V, _HOLD = "delta_v_m_s", "hold_error_m"
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
        record |= {"band_m": band, "samples": len(places), "settled_percent": 100.0 * float(np.isfinite(times).mean())}
        record |= {"median_orbits": found["median"], "quantile_95_orbits": found["quantile_95"]}
        record |= {f"quantile_95_{end}_orbits": found[f"quantile_95_{end}"] for end in ("low", "high")}
        record |= {"worst_sample": found["largest_sample"]}
        for measure in (_DELTA_V, _HOLD):
            if measure in rows:
                of_all = spread(samples, np.asarray(rows[measure], dtype=np.float64)[places])
                record |= {f"{word}_{measure}": of_all[word] for word in ("median", "quantile_95")}
        yield record | {"limited_percent": float(rows["limited_percent"][places].mean())}


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
        if math.isinf(best[column]):
            words.append(f"no law settles in 95 % of {best['samples']} flights {stage}")
        else:
            share = f" in 95 % of {best['samples']} flights" if best["samples"] > 1 else ""
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
