"""The result of a run in one sentence, for each kind of run."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fracctl.report.numbers import count, number
from fracctl.report.stored import StoredRun

Record = Mapping[str, Any]

_VERDICTS = ("better", "equal", "worse", "undecided")
_SETTLING = "settling_2_percent_orbits"
_SAME = 1e-12


def result(run: StoredRun) -> list[str]:
    """Return what came out: a sentence, or one for each initial condition; none of a run without a result."""
    tables = run.tables
    if "comparison" in tables:
        return list(_comparison(tables["comparison"]))
    if "survival" in tables:
        return list(_survival(tables["survival"]))
    if "quantiles" in tables:
        return list(_quantiles(tables["quantiles"]))
    if "laws" in tables and "law" in (run.summary.get("optimum") or {}):
        return list(_laws(tables["laws"]))
    if not run.results:
        return [_sentence(note) for note in run.notes[:1]]
    survey, first = run.configuration["survey"], run.results[0]["objective_name"]
    told = [found for found in run.results if found["objective_name"] == first or survey.get("algorithm") == "nsga2"]
    return [_sentence(_optimum(run, found)) for found in told]


def _optimum(run: StoredRun, found: Record) -> str:
    """The best point of an objective against its baseline."""
    name, optimum, baseline = str(found["objective_name"]), found["optimum"], found["baseline"]
    where, column = found["initial_condition"], f"objective_{name}"
    if optimum is None:
        alone = "" if baseline is None else f"; {_point(run, name, baseline)}"
        return f"from {where} no point is an optimum of {name}{alone}"
    best = run.value_of(name, optimum[column])
    if run.configuration["survey"]["type"] == "single" and baseline in (None, optimum):
        return f"from {where} {name} is {best}{_with(run.design(optimum))}"
    said = f"from {where} {name} is least, {best},{_with(run.design(optimum))}"
    if baseline is None:
        return said
    change = found["change_percent"]
    if baseline == optimum or change is None or abs(change) < _SAME:
        return f"{said}; no point is better than the baseline, {_named(run, baseline)}"
    more = "less" if change < 0.0 else "more"
    base = f"the baseline's {run.value_of(name, baseline[column])}, {_named(run, baseline)}"
    return f"{said}: {abs(change):.1f} % {more} than {base}"


def _point(run: StoredRun, name: str, row: Record) -> str:
    return f"{name} of the baseline is {run.value_of(name, row[f'objective_{name}'])}"


def _named(run: StoredRun, baseline: Record) -> str:
    """What the baseline is: the values that it was given, and its own."""
    if baseline.get("gain_factor") == 0.0:
        return "the free motion"
    return _with(run.design(baseline)).removeprefix(" ") or "the law as it stands"


def _with(design: Record) -> str:
    if "law" in design:
        return f" under {design['law']}"
    return " at " + ", ".join(f"{name} = {number(value, 4)}" for name, value in design.items()) if design else ""


def _laws(records: Sequence[Record]) -> Iterator[str]:
    """When each law settles."""
    for condition, own in _by_start(records):
        if _SETTLING not in own[0]:
            names = ", ".join(str(record["law"]) for record in own)
            yield f"From {condition}: {names} side by side, in the table below."
            continue
        ordered = sorted(own, key=lambda record: math.inf if record[_SETTLING] is None else record[_SETTLING])
        words = [f"under {record['law']} {_orbits(record[_SETTLING])}{_overshoot(record)}" for record in ordered]
        yield f"From {condition} the length settles to 2 % {'; '.join(words)}."


def _overshoot(record: Record) -> str:
    value = record.get("overshoot_percent")
    return "" if value is None or record[_SETTLING] is None else f" with an overshoot of {number(value, 2)} %"


def _quantiles(records: Sequence[Record]) -> Iterator[str]:
    """Median and what 95 % keep of the first measure that varies."""
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for record in records:
        groups.setdefault((record["initial_condition"], record.get("law")), []).append(record)
    for (condition, law), own in groups.items():
        varied = next((record for record in own if record["smallest"] != record["largest"]), own[0])
        who = f"{condition} under {law}" if law else str(condition)
        yield (
            f"From {who}, {count(varied['samples'], 'dispersed run')}: {varied['measure']} has the median "
            f"{number(varied['median'], 4)} and keeps to {_bound(varied['quantile_95'])} in 95 % of them."
        )


def _survival(records: Sequence[Record]) -> Iterator[str]:
    """Which law is fastest when all that a flight meets is there, and which do not settle."""
    for condition, own in _by_start(records):
        last = [record for record in own if record["stage"] == own[-1]["stage"]]
        ordered = sorted(last, key=lambda record: _infinite(record["quantile_95_orbits"]))
        head = f"From {condition} to {number(own[0]['band_m'])} m, flown {own[-1]['stage']}: "
        best = ordered[0]
        share = f" in 95 % of {best['samples']} flights" if best["samples"] > 1 else ""
        if best["quantile_95_orbits"] is None:
            yield f"{head}no law settles{share}."
            continue
        lost = [_law(record) for record in ordered if record["quantile_95_orbits"] is None]
        rest = f"; {', '.join(lost)} {'does' if len(lost) == 1 else 'do'} not" if lost else ""
        yield head + f"{_law(best)} is fastest, {_orbits(best['quantile_95_orbits'])}{share}{rest}."


def _comparison(records: Sequence[Record]) -> Iterator[str]:
    """How often each law is better than the reference, over all problems."""
    reference = next((str(record["law"]) for record in records if record["verdict"] == "reference"), "the reference")
    verdicts: dict[str, Counter[str]] = {}
    for record in records:
        if record["verdict"] in _VERDICTS:
            verdicts.setdefault(str(record["law"]), Counter())[str(record["verdict"])] += 1
    words = [
        f"{law} is " + ", ".join(f"{_times(found[word])} {word}" for word in _VERDICTS if found[word])
        for law, found in verdicts.items()
    ]
    bands = ", ".join(f"{band:g} m" for band in dict.fromkeys(record["threshold_m"] for record in records))
    said = "; ".join(words) or "no verdict"
    yield f"Against {reference}, over all starts and limits and the bands of {bands}: {said}."


def _times(how_many: int) -> str:
    return "once" if how_many == 1 else f"{how_many} times"


def _by_start(records: Sequence[Record]) -> Iterator[tuple[str, list[Record]]]:
    for condition in dict.fromkeys(str(record["initial_condition"]) for record in records):
        yield condition, [record for record in records if record["initial_condition"] == condition]


def _law(record: Record) -> str:
    if "law" in record:
        return str(record["law"])
    names = list(record)
    design = [name for name in names[: names.index("stage")] if name != "initial_condition"]
    return ", ".join(f"{name} = {number(record[name], 4)}" for name in design) or "the law"


def _orbits(value: float | None) -> str:
    return "never" if value is None else f"after {number(value, 3)} orbits"


def _bound(value: float | None) -> str:
    return "no bound" if value is None else number(value, 4)


def _infinite(value: float | None) -> float:
    return math.inf if value is None else value


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."
