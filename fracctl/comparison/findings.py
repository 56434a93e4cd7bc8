"""What a comparison says, in sentences."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fracctl.comparison.compared import ComparedLaws
from fracctl.comparison.problems import MOST_GRID_VARIABLES, OPEN_LOOP
from fracctl.comparison.robustness import HALF_WIDTHS
from fracctl.comparison.statistics import BETTER, EQUAL, UNDECIDED, WORSE, verdict

Record = Mapping[str, Any]
_NO_INTERVAL = (math.nan, math.nan)
_MOST_NAMED = 6
"""Problems that are named one by one."""


def findings(comparison: ComparedLaws, records: Sequence[Record]) -> Iterator[str]:
    """Yield sentences on the table: where fractional orders help, which law is the best, what is left undecided."""
    problems = _problems(records)
    fractional = [name for name in comparison.laws if _is_fractional(comparison, name)]
    integer = [name for name in comparison.laws if name not in fractional]
    for name in fractional:
        yield _against_reference(comparison, name, problems)
    if fractional and integer:
        yield _against_integer(fractional, integer, problems)
    if searched := [name for name in comparison.laws if len(comparison.law_of(name).varied) > MOST_GRID_VARIABLES]:
        names = ", ".join(searched)
        yield f"no grid for {names}, with too many parameters for one: better points than those found may exist"
    best = Counter(min(laws, key=lambda name: _value(laws[name])) for laws in problems.values() if _any(laws))
    counts = ", ".join(f"{name} in {count}" for name, count in best.most_common())
    yield f"best law: {counts} of {len(problems)} problems"
    yield _nearby(comparison, problems)
    open_words = [r for laws in problems.values() for r in laws.values() if r["verdict"] == UNDECIDED]
    if open_words:
        laws = Counter(record["law"] for record in open_words)
        names = ", ".join(f"{name} {count}" for name, count in laws.items())
        yield f"undecided, for the starts of the searches spread too far: {names} of {len(problems)} problems each"
    yield (
        "the open-loop bound is for coming to rest by the settling time; a law need only stay within the band, and "
        "may do with less where the band is wide"
    )


def _problems(records: Sequence[Record]) -> dict[tuple[Any, ...], dict[str, Record]]:
    """Return the laws' records by problem."""
    problems: dict[tuple[Any, ...], dict[str, Record]] = {}
    for record in records:
        if record["law"] != OPEN_LOOP:
            key = tuple(record[name] for name in ("initial_condition", "limit", "limit_value", "threshold_m"))
            problems.setdefault(key, {})[record["law"]] = record
    return problems


def _is_fractional(comparison: ComparedLaws, name: str) -> bool:
    return any(parameter.kind == "order" for parameter in comparison.law_of(name).varied)


def _against_reference(
    comparison: ComparedLaws, name: str, problems: Mapping[tuple[Any, ...], Mapping[str, Record]]
) -> str:
    parts = []
    for band in comparison.thresholds_m:
        words = Counter(laws[name]["verdict"] for key, laws in problems.items() if key[3] == band)
        found = [f"{word} in {words[word]}" for word in (BETTER, EQUAL, WORSE, UNDECIDED) if words[word]]
        parts.append(f"to {band:g} m {', '.join(found) or 'without a result'} of {sum(words.values())}")
    return f"{name} (of fractional order) against {comparison.reference}, settling {'; '.join(parts)}"


def _against_integer(
    fractional: Sequence[str],
    integer: Sequence[str],
    problems: Mapping[tuple[Any, ...], Mapping[str, Record]],
) -> str:
    """Compare the best law of fractional order with the best of integer order."""
    words: Counter[str] = Counter()
    helped = []
    for key, laws in problems.items():
        best = {
            kind: min((_value(laws[name]), name) for name in names)
            for kind, names in (("fractional", fractional), ("integer", integer))
        }
        word = verdict(best["fractional"][0], best["integer"][0], _NO_INTERVAL)
        words[word] += 1
        if word == BETTER:
            gain = 100.0 * (1.0 - best["fractional"][0] / best["integer"][0])
            helped.append((gain, f"{_words(key)} ({gain:.0f} % ahead of {best['integer'][1]})"))
    helped.sort(reverse=True)
    more = f" and {len(helped) - _MOST_NAMED} more" if len(helped) > _MOST_NAMED else ""
    where = f": {'; '.join(text for _, text in helped[:_MOST_NAMED])}{more}" if helped else ""
    return (
        f"a fractional order helps against the best of {', '.join(integer)} in {words[BETTER]} of {len(problems)} "
        f"problems{where}; it makes no difference beyond 2 % in {words[EQUAL]} and is behind in {words[WORSE]}"
    )


def _nearby(comparison: ComparedLaws, problems: Mapping[tuple[Any, ...], Mapping[str, Record]]) -> str:
    """Return how much worse the best points become nearby, and which law is the best at its worst."""
    medians = []
    for name in comparison.laws:
        rows = [laws[name] for laws in problems.values() if math.isfinite(_value(laws[name]))]
        if rows:
            growth = [_value(row, "worst_found_nearby") / _value(row) for row in rows]
            medians.append(f"{name} {np.median(growth):.3g}")
    best = Counter(
        min(laws, key=lambda name: _value(laws[name], "worst_found_nearby"))
        for laws in problems.values()
        if any(math.isfinite(_value(record, "worst_found_nearby")) for record in laws.values())
    )
    counts = ", ".join(f"{name} in {count}" for name, count in best.most_common())
    box = ", ".join(f"{kind}s ±{half:g}" for kind, half in HALF_WIDTHS.items())
    return (
        f"nearby ({box}) the best points become worse by a factor of, in the median, {', '.join(medians)}; by the "
        f"worst nearby the best law is {counts}"
    )


def _words(key: tuple[Any, ...]) -> str:
    condition, limit, value, band = key
    under = f"gains up to {value:g}" if limit == "gain" else f"at most {value:g} mm/s²"
    return f"{condition} to {band:g} m, {under}"


def _value(record: Record, column: str = "objective") -> float:
    value = record[column]
    return math.inf if value is None or math.isnan(value) else float(value)


def _any(laws: Mapping[str, Record]) -> bool:
    return any(math.isfinite(_value(record)) for record in laws.values())
