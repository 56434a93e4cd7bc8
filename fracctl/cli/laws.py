"""Tables of several laws, and of quantiles over dispersed runs, for reading."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fracctl.cli.table import TURN, table
from fracctl.report.numbers import number

Record = Mapping[str, Any]

MOST_COLUMNS = 6
"""More laws than this stand below each other."""
_TIMES = ("_orbits", "_periods")
_UNITS = ("orbits", "min")
_SPREAD = ("quantile_05", "median", "quantile_95")


def law_lines(records: Sequence[Record]) -> list[str]:
    """Return a part for each initial condition: a column for each law, a row for each measure; turned if too wide."""
    lines = []
    for condition in dict.fromkeys(record["initial_condition"] for record in records):
        own = [record for record in records if record["initial_condition"] == condition]
        head = [_heading(own[0]), *(str(record["law"]) for record in own)]
        rows = [head, *([name, *(_cell(name, record) for record in own)] for name in _names(own))]
        lines += table(rows if len(own) <= MOST_COLUMNS else list(zip(*rows, strict=True)))
    return lines


def _heading(record: Record) -> str:
    """The start, and the stage of flights."""
    return ", ".join(str(record[name]) for name in ("initial_condition", "stage") if name in record)


def _names(records: Sequence[Record]) -> list[str]:
    """Columns that are shown: settling to a band once, in all its units; the status where one is not ok."""
    names = dict.fromkeys(name for record in records for name in record)
    fine = all(record.get("status", "ok") == "ok" for record in records)
    hidden = {"initial_condition", "law", "stage", *(["status"] if fine else ())}
    hidden |= {f"{name}_{unit}" for name in names for unit in _UNITS if f"{name}_{unit}" in names}
    return [name for name in names if name not in hidden]


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


def survival_lines(records: Sequence[Record]) -> list[str]:
    """Return a part for each start: a row for each law, the settling time of each stage, then what the last one shows.

    Of stages with several flights stand the median and, in brackets, what 95 % of them keep; of the last one the
    intervals of this quantile and of the share that settles, too.
    """
    lines = []
    for condition in dict.fromkeys(record["initial_condition"] for record in records):
        own = [record for record in records if record["initial_condition"] == condition]
        stages = list(dict.fromkeys(record["stage"] for record in own))
        title = f"{condition}, orbits to {own[0]['band_m']:g} m"
        last = [record for record in own if record["stage"] == stages[-1]]
        several = any(record["samples"] > 1 for record in last)
        further = [name for name in _TAKEN if name in own[0] and (several or name not in _OF_SEVERAL)]
        head = [title, *stages, *(_TAKEN[name] for name in further)]
        rows = []
        for law in dict.fromkeys(_who(record) for record in own):
            of_law = {record["stage"]: record for record in own if _who(record) == law}
            cells = [_settled(of_law[stage]) if stage in of_law else "" for stage in stages]
            rows.append([law, *cells, *(_taken(name, of_law[stages[-1]]) for name in further)])
        lines += table([head, *rows])
    return lines


def implementation_lines(records: Sequence[Record]) -> list[str]:
    """Return a part with a row for each law on board: its margins, its size, and what noise keeps up."""
    first = records[0]["initial_condition"] if records else None
    own = [record for record in records if (record["initial_condition"], record["stage"]) == (first, "sampled")]
    if not own:
        return []
    names = [name for name in _ON_BOARD if name in own[0]]
    ideal = {_name(r): r for r in records if (r["initial_condition"], r["stage"]) == (first, "ideal")}
    rows = [["on board", *(_ON_BOARD[name] for name in names)]]
    for record in own:
        designed = ideal.get(_name(record), {})
        cells = [_short(record[name]) for name in names]
        before = [_short(designed.get(name)) if name in _DESIGNED else "" for name in names]
        rows.append([_name(record), *(f"{c} ({b})" if b else c for c, b in zip(cells, before, strict=True))])
    return table(rows)


def _name(record: Record) -> str:
    return str(record.get("law", "the law"))


def _short(value: Any) -> str:
    return "" if value is None else number(value, 3)


_DESIGNED = ("phase_margin_deg", "gain_margin_db", "sensitivity_peak", "disk_margin")
_ON_BOARD = {
    "phase_margin_deg": "phase, deg (ideal)",
    "gain_margin_db": "gain, dB (ideal)",
    "sensitivity_peak": "M_s (ideal)",
    "disk_margin": "disk margin (ideal)",
    "states": "states",
    "operations": "operations",
    "noise_position_m": "noise, m",
    "noise_control_mm_s2": "noise, mm/s²",
}
"""What is told of laws on board, by the columns of the table."""


_TAKEN = {
    "quantile_95_orbits": "interval of 95 %",
    "settled_percent": "% settled",
    "worst_sample": "worst sample",
    "limited_percent": "% limited",
    "median_delta_v_m_s": "ΔV, m/s",
    "median_station_keeping_mm_s_per_orbit": "last orbit, mm/s",
    "median_hold_error_m": "held, m",
}
"""What is told of the last stage besides, by the columns of the table."""
_OF_SEVERAL = ("quantile_95_orbits", "worst_sample")
"""Of these what needs several flights."""


def _who(record: Record) -> str:
    """The law of a record, or the values that were varied."""
    names = list(record)
    design = [name for name in names[: names.index("stage")] if name != "initial_condition"]
    return ", ".join(str(record[n]) if n == "law" else f"{n} = {_number(record[n])}" for n in design) or "the law"


def _taken(name: str, record: Record) -> str:
    """A number, with its interval where it has one."""
    if name == "quantile_95_orbits":
        low, high = (record[f"quantile_95_{end}_orbits"] for end in ("low", "high"))
        return "never" if low is None else f"[{low:.3f}, {'∞' if high is None else f'{high:.3f}'}]"
    if name == "settled_percent" and record["samples"] > 1:
        low, high = (record[f"settled_percent_{end}"] for end in ("low", "high"))
        return f"{number(record[name], 3)} [{number(low, 3)}, {number(high, 3)}]"
    return _number(record.get(name))


def _settled(record: Record) -> str:
    median, most = (_time(record[name]) for name in ("median_orbits", "quantile_95_orbits"))
    return median if record["samples"] == 1 or median == most else f"{median} ({most})"


def _time(value: Any) -> str:
    return "never" if value is None else f"{value:.3f}"


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


def _cell(name: str, record: Record) -> str:
    """Five digits; times that do not come are none in JSON."""
    if name not in record:
        return ""
    if f"{name}_orbits" in record:
        orbits, minutes = record[f"{name}_orbits"], record[f"{name}_min"]
        return "never" if orbits is None else f"{orbits:.3f} orbits, {minutes:.1f} min"
    value = record[name]
    if name == "settling_time" and value is not None:
        return f"{number(value, 5)} = {value / TURN:.4f} T"
    return "never" if value is None and name.endswith(_TIMES) else number(value, 5)


def _number(value: Any) -> str:
    """Five digits; what JSON cannot hold has no bound."""
    return "∞" if value is None else number(value, 5)
