"""The table of a comparison for reading: laws below each other, settling bands side by side."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fracctl.cli.table import table

Record = Mapping[str, Any]

_VERDICTS = ("better", "equal", "worse", "undecided")


def comparison_lines(records: Sequence[Record], in_orbits: bool) -> list[str]:
    """Return a part for each initial condition and limit.

    Args:
        records: the rows of ``comparison.parquet``.
        in_orbits: whether the objective is the settling time alone, which is shown in orbits.
    """
    lines = []
    for key in dict.fromkeys(_key(record) for record in records):
        own = [record for record in records if _key(record) == key]
        bands = list(dict.fromkeys(record["threshold_m"] for record in own))
        head = [_title(key), *(f"to {band:g} m" for band in bands)]
        laws = dict.fromkeys(record["law"] for record in own)
        rows = [[law, *(_cell(record, in_orbits) for record in own if record["law"] == law)] for law in laws]
        lines += table([head, *rows])
    return lines


def _key(record: Record) -> tuple[str, str, float]:
    return record["initial_condition"], record["limit"], record["limit_value"]


def _title(key: tuple[str, str, float]) -> str:
    condition, limit, value = key
    return f"{condition}, gains ≤ {value:g}" if limit == "gain" else f"{condition}, ≤ {value:g} mm/s²"


def _cell(record: Record, in_orbits: bool) -> str:
    return "  ".join(_words(record, in_orbits)) or "-"


def _words(record: Record, in_orbits: bool) -> Iterator[str]:
    value, effort = record["objective"], record["delta_v_m_per_s"]
    if record["law"] == "open_loop":
        if effort is not None and math.isfinite(effort):
            yield f"ΔV ≥ {effort:.1f} m/s"
        return
    if value is None or not math.isfinite(value):
        return
    yield f"{value / (2.0 * math.pi):.3f} T" if in_orbits else f"{value:.4g}"
    yield f"{effort:.1f} m/s"
    if record["verdict"] in _VERDICTS:
        yield str(record["verdict"])
