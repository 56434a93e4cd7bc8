"""Several runs side by side: what tells them apart, and the results that they share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fracctl.config.messages import shown
from fracctl.report.contents import CAPTIONS, LAWS, Picture, pictures, shown_point
from fracctl.report.sentences import result
from fracctl.report.stored import StoredRun
from fracctl.report.tables import Cell, Column, Table, cell, of_records, upright
from fracctl.store.identity import NOT_IN_IDENTITY

_LAST_KEYS = {"comparison": "law", "survival": "stage", "quantiles": "measure"}
"""The last of the columns, by table, that say what a row is."""
_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


@dataclass(frozen=True)
class LabelledRun:
    """A run and what it is called on the page."""

    label: str
    """``A: ic1_outofplane``."""
    run: StoredRun

    @property
    def short(self) -> str:
        """The letter alone."""
        return self.label.partition(":")[0]


_Labelled = tuple[LabelledRun, Mapping[str, Any]]


def labelled(runs: Sequence[StoredRun]) -> list[LabelledRun]:
    """Return runs with letters; numbers from the 27th on."""
    names = [_LETTERS[place] if place < len(_LETTERS) else str(place + 1) for place in range(len(runs))]
    return [LabelledRun(f"{name}: {run.name}", run) for name, run in zip(names, runs, strict=True)]


def overview(runs: Sequence[LabelledRun]) -> Table:
    """Return a row for each run: what it is, how it ended, what came out."""
    columns = [Column(name, is_name=False) for name in ("run", "run id", "status")]
    columns += [Column("wall time", "s", is_name=False, right=True), Column("result", is_name=False)]
    rows = [
        [
            Cell(entry.label),
            Cell(entry.run.run_id),
            Cell(entry.run.status),
            cell(entry.run.provenance.get("wall_time_s")),
            Cell(" ".join(result(entry.run)) or "none"),
        ]
        for entry in runs
    ]
    return Table("The runs", columns, rows)


def differences(runs: Sequence[LabelledRun]) -> Table:
    """Return the keys of the configuration whose values differ, with the value of each run."""
    flat = [dict(_flat(entry.run.configuration)) for entry in runs]
    keys = dict.fromkeys(key for values in flat for key in values)
    differing = [key for key in keys if any(values.get(key, "–") != flat[0].get(key, "–") for values in flat)]
    columns = [Column("key", is_name=False), *(Column(entry.label, is_name=False) for entry in runs)]
    rows = [[Cell(key), *(Cell(values.get(key, "–")) for values in flat)] for key in differing]
    remark = "" if rows else "The configurations are the same."
    return Table("Where the configurations differ", columns, rows, remark)


def _flat(value: Any, above: tuple[str, ...] = ()) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping) and value:
        for key, entry in value.items():
            if above or key not in NOT_IN_IDENTITY:
                yield from _flat(entry, (*above, str(key)))
    else:
        yield ".".join(above), "{}" if value == {} else shown(value)


def results(runs: Sequence[LabelledRun]) -> list[Table]:
    """Return a table for each objective and initial condition that several runs have, and those of evaluations."""
    found: dict[tuple[str, str], list[tuple[LabelledRun, Mapping[str, Any]]]] = {}
    for entry in runs:
        for optimum in entry.run.results:
            if optimum["optimum"] is not None:
                key = (str(optimum["objective_name"]), str(optimum["initial_condition"]))
                found.setdefault(key, []).append((entry, optimum))
    shared = [_side_by_side(*key, of_key) for key, of_key in found.items() if len(of_key) > 1]
    return shared + list(_concluded(runs))


def _side_by_side(objective: str, condition: str, entries: Sequence[tuple[LabelledRun, Mapping[str, Any]]]) -> Table:
    column, first = f"objective_{objective}", entries[0]
    change = f"change against {first[0].short}, %"
    points = []
    for entry, optimum in entries:
        point = shown_point(entry.run, objective, optimum["optimum"])
        if base := first[1]["optimum"][column]:
            point = {change: 100.0 * (optimum["optimum"][column] / base - 1.0)} | point
        points.append((entry.label, point))
    names = dict.fromkeys(name for _, point in points for name in point)
    return upright(f"Optimum of {objective} from {condition}", names, points)


def _concluded(runs: Sequence[LabelledRun]) -> Iterator[Table]:
    """Tables of evaluations that several runs have, joined."""
    names = [name for entry in runs for name in entry.run.tables]
    for name in dict.fromkeys(name for name in names if names.count(name) > 1):
        records = [(entry, record) for entry in runs for record in entry.run.tables.get(name, ())]
        if name != LAWS:
            yield _joined(name, records)
            continue
        for condition in dict.fromkeys(record["initial_condition"] for _, record in records):
            yield _laws(condition, [pair for pair in records if pair[1]["initial_condition"] == condition])


def _laws(condition: str, records: Sequence[_Labelled]) -> Table:
    """A column for each law of each run; the same law of several runs stands together."""
    laws = dict.fromkeys(record["law"] for _, record in records)
    columns = [(entry, record) for law in laws for entry, record in records if record["law"] == law]
    names = dict.fromkeys(name for _, record in columns for name in record if name not in ("initial_condition", "law"))
    points = [(f"{entry.short}: {record['law']}", record) for entry, record in columns]
    return upright(f"{CAPTIONS[LAWS]}, from {condition}", names, points)


def _joined(table: str, records: Sequence[_Labelled]) -> Table:
    """The rows of all runs; those of the same start, law and so on stand together, the run behind what they share."""
    rows: dict[tuple[tuple[str, Any], ...], list[dict[str, Any]]] = {}
    for entry, record in records:
        names = list(record)
        end = names.index(_LAST_KEYS[table]) + 1
        keys = {name: record[name] for name in names[:end]}
        own = {name: record[name] for name in names[end:]}
        rows.setdefault(tuple(keys.items()), []).append(keys | {"run": entry.short} | own)
    joined = [row for together in rows.values() for row in together]
    return of_records(CAPTIONS[table], joined, f"{table}.csv of each run")


def figures(runs: Sequence[LabelledRun]) -> tuple[dict[str, list[tuple[str, Picture]]], list[str]]:
    """Return pictures by the name of the figure with the labels of their runs, and what cannot be drawn."""
    found: dict[str, list[tuple[str, Picture]]] = {}
    problems = []
    for place, entry in enumerate(runs):
        drawn, undrawn = pictures(entry.run, f"r{place}f")
        problems += [f"{entry.label}: {problem}" for problem in undrawn]
        for picture in drawn:
            found.setdefault(picture.name, []).append((entry.label, picture))
    return found, problems
