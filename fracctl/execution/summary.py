"""The summary of a run, as ``--json`` prints it and ``run.json`` holds it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fracctl.evaluation import Evaluation
from fracctl.execution.row_store import RowStore
from fracctl.store.columns import REASON
from fracctl.surveys.base import POINT, SEARCHED_FOR, Rows

Optimum = Mapping[str, Any]

_ADDED_COLUMNS = ("kind", "slice", "objective_name", POINT, REASON, SEARCHED_FOR)
_OPTIMUM_NEEDS = (
    "an optimum has status ok, keeps to all constraints, is not unstable, has a finite value, and some control effort "
    "if that is part of it"
)


class Tally:
    """Counts the rows of each initial condition by status."""

    def __init__(self) -> None:
        self._counts: dict[str, Counter[str]] = {}

    def add(self, rows: Rows) -> None:
        """Count further rows."""
        names, words = rows["initial_condition"], rows["status"]
        for name in dict.fromkeys(names.tolist()):
            self._counts.setdefault(name, Counter()).update(words[names == name].tolist())

    def total(self, word: str) -> int:
        """Return the number of rows with this status."""
        return sum(counts[word] for counts in self._counts.values())

    @property
    def rows(self) -> int:
        """Number of all rows."""
        return sum(counts.total() for counts in self._counts.values())

    def only(self, initial_condition: str) -> bool:
        """Return whether there is but one row of an initial condition."""
        return self._counts.get(initial_condition, Counter()).total() == 1

    def sentence(self, initial_condition: str) -> str:
        """Return e.g. ``2 unsettled, 1 unstable``."""
        counts = self._counts.get(initial_condition, Counter())
        return ", ".join(f"{count} {word}" for word, count in counts.most_common())


def results(evaluation: Evaluation, optima: Iterable[Optimum]) -> list[dict[str, Any]]:
    """Return optimum, baseline and change for every objective, the primary one first, and initial condition."""
    rows = list(optima)
    names = sorted(evaluation.objectives, key=lambda name: name != evaluation.objective)
    return [_result(rows, ic, name) for name in names for ic in evaluation.initial_conditions]


def _result(optima: Sequence[Optimum], initial_condition: str, objective: str) -> dict[str, Any]:
    def of(kind: str) -> dict[str, Any] | None:
        key = (kind, objective, initial_condition)
        found = [row for row in optima if (row["kind"], row["objective_name"], row["initial_condition"]) == key]
        return _values(found[0]) if found else None

    optimum, baseline = of("overall"), of("baseline")
    return {
        "initial_condition": initial_condition,
        "objective_name": objective,
        "optimum": optimum,
        "baseline": baseline,
        "change_percent": _change(optimum, baseline, f"objective_{objective}"),
    }


def _values(row: Optimum) -> dict[str, Any]:
    return {name: finite_or_none(value) for name, value in row.items() if name not in _ADDED_COLUMNS}


def finite_or_none(value: Any) -> Any:
    """Return a value as JSON can hold it: null for infinities and NaN."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plain_tables(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, list[dict[str, Any]]]:
    """Return tables as JSON can hold them."""
    return {
        name: [{column: finite_or_none(value) for column, value in record.items()} for record in records]
        for name, records in tables.items()
    }


def _change(optimum: Optimum | None, baseline: Optimum | None, column: str) -> float | None:
    if optimum is None or baseline is None or not baseline[column]:
        return None
    return 100.0 * (float(optimum[column]) / float(baseline[column]) - 1.0)


def notes_on(found: Sequence[Mapping[str, Any]], baseline: Mapping[str, float], tally: Tally) -> list[str]:
    """Return a sentence for every result that is missing."""
    notes = []
    for result in found:
        where = f"{result['objective_name']} for {result['initial_condition']}"
        if result["optimum"] is None and tally.only(result["initial_condition"]) and result["baseline"] is not None:
            continue
        if result["optimum"] is None:
            counts = tally.sentence(result["initial_condition"])
            notes.append(f"no optimum of {where} (points: {counts}); {_OPTIMUM_NEEDS}")
        elif baseline and result["baseline"] is None:
            values = ", ".join(f"{name} = {value:g}" for name, value in baseline.items())
            notes.append(f"no baseline of {where}: no point with {values} can be an optimum")
    if failed := tally.total("failed"):
        notes.append(f"{failed} of {tally.rows} rows failed and are in no result")
    return notes


def summarise(
    identity: Mapping[str, str], store: RowStore, found: Sequence[dict[str, Any]], notes: Sequence[str]
) -> dict[str, Any]:
    """Return the summary; `identity` holds experiment, run_id and run_directory."""
    first = found[0] if found else dict.fromkeys(("optimum", "baseline", "change_percent"))
    return {
        **identity,
        "status": "incomplete" if store.failures else "finished",
        "reused": False,
        "optimum": first["optimum"],
        "baseline": first["baseline"],
        "change_percent": first["change_percent"],
        "error": _error(store),
        "failed_points": store.failed_points,
        "optima": list(found),
        "notes": list(notes),
    }


def missing(failed_points: int | None) -> str:
    """Return what stands beside a result that lacks points, empty where it lacks none."""
    return f"incomplete: {failed_points} point{'' if failed_points == 1 else 's'} missing" if failed_points else ""


def _error(store: RowStore) -> str | None:
    if not store.failures:
        return None
    reason = next(iter(store.failures.values()))
    return f"{store.failed_points} points could not be computed ({reason}); the same command tries them again"
