"""The summary of several runs: a row for each run and initial condition, best first."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from fracctl.config.schemas import RunConfig
from fracctl.store import directory_of, tables
from fracctl.store.columns import DIMENSIONLESS, unit
from fracctl.store.files import make_directory
from fracctl.store.identity import canonical_json
from fracctl.units import Scales

FOLDER = "multirun"

_WORDS = (
    *("experiment", "initial_condition", "objective_name", "factors", "unit"),
    *("status", "error", "run_id", "run_directory"),
)
"""Result columns that hold words; the others hold numbers."""


@dataclass(frozen=True)
class Entry:
    """One run of a sweep, and what became of it."""

    config: RunConfig
    varied: Mapping[str, str]
    """What the sweep sets in it: values by key."""
    scales: Scales | None = None
    """Of the plant."""
    summary: Mapping[str, Any] | None = None
    """None where there is no result."""
    error: str | None = None
    """What went wrong."""
    status: str = "not started"
    """Without a summary: ``failed``, ``interrupted``, ``not started``."""


def summary_path(configs: Sequence[RunConfig]) -> Path:
    """Return ``<output_dir>/multirun/<id>/summary.parquet``; the id is a hash of the runs, whatever their order."""
    ids = sorted({directory_of(config.model_dump(mode="json")).path.name for config in configs})
    folder = hashlib.sha256(canonical_json(ids).encode()).hexdigest()[: len(ids[0])]
    return Path(configs[0].output_dir).absolute() / FOLDER / folder / "summary.parquet"


def write_summary(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write the summary.

    Raises:
        RunError: the disk is full or not writable.
    """
    names = list(dict.fromkeys(name for row in rows for name in row))
    schema = pa.schema([_field(name, [row.get(name) for row in rows]) for name in names])
    make_directory(path.parent)
    tables.write(path, schema, [pa.Table.from_pylist([dict(row) for row in rows], schema=schema)])


def summary_rows(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Return the rows: what was varied, then objectives, status and run directory.

    Runs of one objective, by name and factors, stand together, best first, those without a result last. Values that
    are all numbers are numbers. ``length_scale_m`` and ``time_scale_s`` say what 1 stands for in dimensionless values.
    """
    numeric = {key for key in _keys(entries) if all(_as_number(entry.varied[key]) is not None for entry in entries)}
    rows = [row for entry in entries for row in _rows(entry, numeric)]
    groups = list(dict.fromkeys(group_of(row) for row in rows))
    return sorted(rows, key=lambda row: (groups.index(group_of(row)), _rank(row["objective"])))


def group_of(row: Mapping[str, Any]) -> tuple[Any, Any]:
    """Return what rows that may be ranked with each other have in common."""
    return row["objective_name"], row["factors"]


def _keys(entries: Sequence[Entry]) -> list[str]:
    return list(entries[0].varied)


def _rank(value: float | None) -> float:
    return math.inf if value is None or math.isnan(value) else value


def _rows(entry: Entry, numeric: set[str]) -> Iterator[dict[str, Any]]:
    config = entry.config
    factors = config.objectives[config.objective]
    varied = {key: _as_number(text) if key in numeric else text for key, text in entry.varied.items()}
    varied.pop("objective", None)  # it is the objective's name
    common = {"experiment": config.name} | varied
    scales = {
        "length_scale_m": entry.scales.length_m if entry.scales else None,
        "time_scale_s": entry.scales.time_s if entry.scales else None,
    }
    found, directory = entry.summary or {}, directory_of(config.model_dump(mode="json"))
    end = {
        "status": found.get("status", entry.status),
        "error": found.get("error", entry.error),
        "run_id": directory.path.name,
        "run_directory": found.get("run_directory", str(directory.path) if directory.status else None),
    }
    for result in _results(found, config.objective):
        optimum = result.get("optimum") or {}
        condition = result.get("initial_condition") or ", ".join(config.initial_condition)
        objectives = {name: value for name, value in optimum.items() if name.startswith("objective_")}
        yield {
            **common,
            "initial_condition": condition,
            "objective_name": config.objective,
            "factors": " · ".join(factors),
            "unit": _unit(factors),
            "objective": optimum.get(f"objective_{config.objective}"),
            **objectives,
            "change_percent": result.get("change_percent"),
            **scales,
            **end,
        }


def _results(summary: Mapping[str, Any], objective: str) -> list[Mapping[str, Any]]:
    """The results for the primary objective by initial condition; an empty one where there is none."""
    results = summary.get("optima") or ([summary] if summary.get("optimum") else [])
    return [one for one in results if one.get("objective_name", objective) == objective] or [{}]


def _unit(factors: Sequence[str]) -> str:
    units = [unit(factor) for factor in factors]
    if len(units) == 1:
        return units[0]
    return DIMENSIONLESS if set(units) == {DIMENSIONLESS} else f"({' · '.join(units)})^(1/{len(units)})"


def _as_number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _field(name: str, values: Sequence[Any]) -> pa.Field:
    text = name in _WORDS or any(isinstance(value, str) for value in values)
    return pa.field(name, pa.string()) if text else pa.field(name, pa.float64(), metadata={"unit": unit(name)})
