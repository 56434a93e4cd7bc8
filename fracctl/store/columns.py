"""Columns of the tables: their types, their units, and the way between arrays and Arrow."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from fracctl.arrays import Array
from fracctl.surveys.base import EVALUATIONS_SPENT, POINT, SEARCHED_FOR

REASON = "reason"
"""Why a row failed; null where it did not."""

SIGMA, W = "sigma", "w"
"""Words of `variable` in ``poles.parquet``: poles σ; eigenvalues w of the pseudo-state matrix, w^denominator = σ."""

TEXT = (
    *("variable", "initial_condition", "status", REASON, "kind", "objective_name", "solver", SEARCHED_FOR),
    *("law", "part", "limit", "verdict", "found_by", "found_for", "measure", "stage"),
)
"""Columns that hold words."""
_WHOLE = (POINT, "run", "samples", EVALUATIONS_SPENT, "principal_poles", "denominator")
_FLAGS = ("stable", "all_poles_found")
_UNITS = {
    "seconds_per_trajectory": "s",
    "_m_per_s": "m/s",
    "_mm_s_per_orbit": "mm/s per orbit",
    "_mm_s2": "mm/s²",
    "_m_s": "m/s",
    "_min": "min",
    "_kg": "kg",
    "_mm_per_s2": "mm/s²",
    "_m": "m",
    "_km": "km",
    "_deg": "deg",
    "_db": "dB",
    "delay_margin_s": "s",
    "_percent": "%",
    "_orbits": "orbits",
    "_periods": "periods",
    "_rad": "rad",
    "_min_n": "N",
    "_max_n": "N",
    "change_percent": "%",
}
DIMENSIONLESS = "1"


def schema(
    columns: Sequence[str], counters: Collection[str] = (), metadata: Mapping[str, str] | None = None
) -> pa.Schema:
    """Return the typed schema of a table; `counters` are whole numbers, numbers carry their unit."""
    return pa.schema([_field(name, counters) for name in columns], metadata=dict(metadata or {}))


def _field(name: str, counters: Collection[str]) -> pa.Field:
    if name in TEXT:
        return pa.field(name, pa.string())
    if name in _FLAGS:
        return pa.field(name, pa.bool_())
    kind = pa.int64() if name in _WHOLE or name in counters else pa.float64()
    return pa.field(name, kind, metadata={"unit": unit(name)})


def unit(name: str) -> str:
    """Return the unit that a column's name ends with, ``1`` for a dimensionless one.

    Settling times to bands in metres are dimensionless, and so are the least tensions of a tether.
    """
    if (name.startswith("settling_time_") and name.endswith("_m")) or name.endswith("tension_min"):
        return DIMENSIONLESS
    return next((word for suffix, word in _UNITS.items() if name.endswith(suffix)), DIMENSIONLESS)


def to_table(rows: Mapping[str, Array], wanted: pa.Schema) -> pa.Table:
    """Return arrays as a table; a column that is missing is null."""
    n_rows = len(next(iter(rows.values())))
    arrays = [_to_arrow(rows.get(field.name), field.type, n_rows) for field in wanted]
    return pa.Table.from_arrays(arrays, schema=wanted)


def _to_arrow(values: Array | None, kind: pa.DataType, n_rows: int) -> pa.Array:
    if values is None:
        return pa.nulls(n_rows, kind)
    if kind in (pa.string(), pa.bool_()):
        return pa.array(np.asarray(values, dtype=object), type=kind)
    return pa.array(np.asarray(values), type=kind)


def to_rows(table: pa.Table) -> dict[str, Array]:
    """Return a table as arrays; words and verdicts become objects, nulls None."""
    return {name: _to_numpy(table.column(name)) for name in table.column_names}


def _to_numpy(column: pa.ChunkedArray) -> Array:
    if column.null_count and pa.types.is_integer(column.type):
        objects = np.empty(len(column), dtype=object)
        objects[:] = column.to_pylist()
        return objects
    array: Array = column.to_numpy()
    return array.astype(object) if column.type == pa.bool_() else array


def records_table(records: Iterable[Mapping[str, Any]], wanted: pa.Schema) -> pa.Table:
    """Return rows given one by one as a table."""
    return pa.Table.from_pylist([dict(record) for record in records], schema=wanted)
