"""Tables of several laws, and of quantiles over dispersed runs, for reading."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fracctl.cli.table import number, table

Record = Mapping[str, Any]

_TIMES = ("_orbits", "_periods")
_SPREAD = ("quantile_05", "median", "quantile_95")


def law_lines(records: Sequence[Record]) -> list[str]:
    """Return a part for each initial condition: a column for each law, a row for each measure."""
    lines = []
    for condition in dict.fromkeys(record["initial_condition"] for record in records):
        own = [record for record in records if record["initial_condition"] == condition]
        names = [name for name in own[0] if name not in ("initial_condition", "law")]
        head = [str(condition), *(str(record["law"]) for record in own)]
        lines += table([head, *([name, *(_cell(name, record[name]) for record in own)] for name in names)])
    return lines


def quantile_lines(records: Sequence[Record]) -> list[str]:
    """Return a part for each group of dispersed runs: a row for each measure that varies."""
    lines = []
    groups = list(dict.fromkeys(_group(record) for record in records))
    for group in groups:
        own = [record for record in records if _group(record) == group and record["smallest"] != record["largest"]]
        title = ", ".join(text if name in ("initial_condition", "law") else f"{name} = {text}" for name, text in group)
        head = [title, "5 %", "median", "95 %", "interval of 95 %", "smallest", "sample", "largest", "sample"]
        lines += table([head, *(list(_cells(record)) for record in own)])
    return lines


def _group(record: Record) -> tuple[tuple[str, str], ...]:
    names = list(record)
    return tuple((name, _number(record[name])) for name in names[: names.index("measure")])


def _cells(record: Record) -> Iterator[str]:
    yield str(record["measure"])
    for name in _SPREAD:
        yield _number(record[name])
    yield f"[{_number(record['quantile_95_low'])}, {_number(record['quantile_95_high'])}]"
    for name in ("smallest", "largest"):
        yield _number(record[name])
        yield number(record[f"{name}_sample"])


def _cell(name: str, value: Any) -> str:
    """Five digits; times that do not come are none in JSON."""
    return "never" if value is None and name.endswith(_TIMES) else number(value, 5)


def _number(value: Any) -> str:
    """Five digits; what JSON cannot hold has no bound."""
    return "∞" if value is None else number(value, 5)
