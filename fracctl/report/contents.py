"""The parts of a report on one run: what was run, tables, figures, and the command that repeats it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pyarrow as pa
import yaml

from fracctl.arrays import Array
from fracctl.config.build import build_checked
from fracctl.config.compose import to_yaml
from fracctl.errors import FracctlError, RunError
from fracctl.figures import drawing
from fracctl.report.numbers import count
from fracctl.report.pictures import inline
from fracctl.report.stored import StoredRun
from fracctl.report.tables import MOST_ROWS, Table, of_frame, of_records, upright
from fracctl.report.words import explain
from fracctl.store import tables as stored_tables
from fracctl.store.identity import run_id, sources_digest

_NOT_OF_THE_RUN = ("scheduler", "figures", "stored in")
"""Parts of the explanation that say nothing of what was computed."""
_OF_THE_PAPER = re.compile(r" \(Figures? [^)]*\)")
_AFTER_THE_MEASURES = "objective"
_ALWAYS = ("status", "stable", "error_estimate", "dominant_pole_real", "dominant_pole_imag")
"""What a table of optima shows beside design variables, measures and the objective."""
LAWS = "laws"
CAPTIONS = {
    LAWS: "The laws side by side",
    "comparison": "Every law at its best, by start, limit and band",
    "survival": "What survives: settling of each law, stage by stage",
    "implementations": "Laws as designed and as they run on board",
    "quantiles": "Quantiles over dispersed runs, with intervals of 95 % confidence",
}


@dataclass(frozen=True)
class Picture:
    """A figure on a page."""

    name: str
    about: str
    svg: str


@dataclass(frozen=True)
class Again:
    """How a run is repeated."""

    text: str
    """A line for a shell; empty where none is known."""
    remark: str


def in_words(run: StoredRun) -> list[tuple[str, str]]:
    """Return name and text of every part of a run; none where the configuration does not fit this version."""
    if run.config is None:
        return []
    try:
        rows = explain(run.config, *build_checked(run.config))
    except FracctlError:
        return []
    shown, part = [], ""
    for name, text in rows:
        part = name or part
        if part not in _NOT_OF_THE_RUN:
            shown.append((name, text))
    return shown


def tables(run: StoredRun) -> tuple[list[Table], list[str]]:
    """Return the tables of what the run stored, and a sentence for each file that cannot be read."""
    found, problems = [*_results(run), *_concluded(run)], []
    for path, read in ((run.directory.optima_path, _slices), (run.directory.evaluations_path, _evaluated)):
        try:
            found += read(run) if path.exists() else ()
        except RunError as problem:
            problems.append(str(problem))
    return found, problems


def _results(run: StoredRun) -> Iterator[Table]:
    """A table for each objective: optimum and baseline of every initial condition."""
    for name in dict.fromkeys(result["objective_name"] for result in run.results):
        own = [result for result in run.results if result["objective_name"] == name]
        points = [
            (f"{result['initial_condition']}, {kind}", shown_point(run, name, result[kind]))
            for result in own
            for kind in ("optimum", "baseline")
            if result[kind] is not None and (kind == "optimum" or result[kind] != result["optimum"])
        ]
        if points:
            names = list(dict.fromkeys(quantity for _, point in points for quantity in point))
            factors = run.configuration["objectives"].get(name, [name])
            mean = f", {name} = ({' · '.join(factors)})^(1/{len(factors)})" if len(factors) > 1 else ""
            yield upright(f"Optima of {name}{mean}", names, points)


def shown_point(run: StoredRun, objective: str, row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a table shows of an optimum; a settling time in orbits too."""
    names = list(row)
    end = names.index(_AFTER_THE_MEASURES) if _AFTER_THE_MEASURES in names else len(names)
    shown: dict[str, Any] = {}
    for name in names[:end]:
        if name != "initial_condition":
            shown[name] = row[name]
        if name == "settling_time" and row[name] is not None:
            shown["settling time"] = run.time(row[name])
    if len(run.configuration["objectives"].get(objective, ())) > 1:
        shown[f"objective_{objective}"] = row[f"objective_{objective}"]
    return shown | {name: row[name] for name in _ALWAYS if name in row}


def _concluded(run: StoredRun) -> Iterator[Table]:
    """The tables of the evaluation, with the columns that the summary holds."""
    for name, records in run.tables.items():
        caption, whole = CAPTIONS.get(name, name), f"{name}.csv and {name}.parquet"
        if name != LAWS or not records:
            yield of_records(caption, records, whole)
            continue
        for condition in dict.fromkeys(record["initial_condition"] for record in records):
            own = [record for record in records if record["initial_condition"] == condition]
            names = [column for column in own[0] if column not in ("initial_condition", "law")]
            yield upright(f"{caption}, from {condition}", names, [(str(record["law"]), record) for record in own])


def _slices(run: StoredRun) -> Iterator[Table]:
    optima = run.directory.optima()
    slices = optima[optima["kind"] == "slice"].drop(columns=["kind", "slice"])
    for name in dict.fromkeys(slices["objective_name"]):
        own = slices[slices["objective_name"] == name].drop(columns="objective_name")
        unwanted = [column for column in own if str(column).startswith("objective") and column != f"objective_{name}"]
        yield of_frame(f"The best point of each slice, by {name}", own.drop(columns=unwanted), "optima.parquet")


def _evaluated(run: StoredRun) -> Iterator[Table]:
    """The evaluated points, the best ones first where there is an objective; only those that are shown are held."""
    best_by = str(run.configuration["objective"])
    column = f"objective_{best_by}"
    words, shown = Counter[str](), None
    for piece in stored_tables.stream(run.directory.evaluations_path):
        words.update(piece.column("status").to_pylist())
        rows = piece if shown is None else pa.concat_tables([shown, piece])
        shown = rows.take(_best(rows, column)) if column in rows.column_names else rows.slice(0, MOST_ROWS)
    if shown is None:
        return
    if column not in shown.column_names:
        best_by = ""
    total = words.total()
    caption = f"Evaluated points: {count(total, 'row')}, {', '.join(f'{n} {word}' for word, n in words.most_common())}"
    yield of_frame(caption, stored_tables.to_pandas(shown), "evaluations.parquet", best_by, total)


def _best(rows: pa.Table, column: str) -> Array:
    """Places of the best rows, first those that may be optima."""
    frame = stored_tables.to_pandas(rows.select(["status", "stable", column]))
    frame["bad"] = ~(frame["status"].eq("ok") & ~frame["stable"].eq(False).fillna(False))
    return frame.sort_values(["bad", column], kind="stable").index[:MOST_ROWS].to_numpy()


def pictures(run: StoredRun, prefix: str) -> tuple[list[Picture], list[str]]:
    """Return the figures of a run, and a sentence for each that cannot be drawn.

    Args:
        run: which is finished; of another, nothing is drawn.
        prefix: of the names in the pictures.
    """
    drawn, problems = [], []
    wanted: Mapping[str, Mapping[str, Any]] = run.configuration.get("figures") or {}
    for place, (name, options) in enumerate(wanted.items() if run.summary else ()):
        try:
            made = drawing(run.directory, name, options)
        except FracctlError as problem:
            problems.append(f"figure '{name}': {problem}")
            continue
        about = _OF_THE_PAPER.sub("", made.about)
        drawn.append(Picture(name, about, inline(made.svg, f"{prefix}{place}")))
    return drawn, problems


def configuration_text(run: StoredRun) -> str:
    """Return the resolved configuration as YAML."""
    if run.config is not None:
        return to_yaml(run.config)
    return yaml.safe_dump(run.configuration, sort_keys=False, allow_unicode=True)


def command(run: StoredRun) -> Again:
    """Return the command that started a run, and what it gives now."""
    if run.config is None:
        return Again("", "The configuration is of another version of fracctl, which does not read it any more.")
    if run.command is None:
        return Again("", "The run was stored without its command; its configuration stands below in full.")
    lost = run.command.lost
    return Again(run.command.line, f"It gives another run now: {lost}." if lost else _given(run))


def _given(run: StoredRun) -> str:
    """Whether the command gives the same run id here, or why it does not."""
    assert run.config is not None
    assert run.command is not None
    try:
        found = run_id(run.command.compose().model_dump(mode="json"))
    except FracctlError as problem:
        return f"It gives no run any more: {problem}."
    named = f" {run.command.study} is the study." if run.command.study else ""
    if found == run.run_id:
        stored = "--fresh computes it again" if run.status == "finished" else "it goes on from there"
        return f"It gives the run id {run.run_id}; where that run is stored, {stored}.{named}"
    if found != run_id(run.config.model_dump(mode="json")):
        return "It gives another configuration now, for files that it names have changed since."
    other = run.provenance.get("sources") != sources_digest()
    why = "of fracctl" if other else "of NumPy or SciPy"
    return (
        f"It gives the same configuration, but another run id: this run is of another version {why} than this report."
    )


def provenance_rows(run: StoredRun) -> list[tuple[str, str]]:
    """Return where a run comes from: what, and its value."""
    found = run.provenance
    versions = found.get("versions") or {}
    rows = [
        ("run id", run.run_id),
        ("status", run.status),
        ("directory", str(run.directory.path)),
        ("versions", ", ".join(f"{name} {version}" for name, version in versions.items() if version)),
        ("commit", found.get("commit")),
        ("sources, SHA-256", found.get("sources")),
        ("platform", found.get("platform")),
        ("cores", found.get("cores")),
        ("worker processes", found.get("workers")),
        ("seed", found.get("seed")),
        ("started", found.get("started")),
        ("written", found.get("written")),
        ("wall time", _seconds(found.get("wall_time_s"))),
        ("processor time", _seconds(found.get("cpu_time_s"))),
    ]
    return [(name, str(value)) for name, value in rows if value not in (None, "")]


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3g} s"
