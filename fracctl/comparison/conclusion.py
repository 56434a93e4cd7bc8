"""From all rows of a comparison to its table, what it says, and the points that are solved again."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.comparison.bounds import BOUND
from fracctl.comparison.compared import ComparedLaws
from fracctl.comparison.findings import findings
from fracctl.comparison.laws import LARGEST_GAIN
from fracctl.comparison.problems import LAW, OPEN_LOOP, PART, Problem, settling_time_within
from fracctl.comparison.robustness import AXES, HORIZON, INTERIOR, WORST
from fracctl.comparison.searches import GRID, ONWARD, SEARCHED
from fracctl.comparison.selection import Selection
from fracctl.comparison.statistics import Ratio, best_ratio, paired_ratio, verdict
from fracctl.evaluation import Conclusion
from fracctl.measures import PeakAcceleration
from fracctl.surveys.base import EVALUATIONS_SPENT

TABLE = "comparison"
"""Name of the table."""
SHOWN = (
    *("initial_condition", "limit", "limit_value", "threshold_m", LAW, "objective", "settling_time_orbits"),
    *("delta_v_m_per_s", "peak_acceleration_mm_per_s2", "worst_found_nearby", "verdict"),
)
"""Columns that the summary of a run holds."""
REFERENCE = "reference"
"""Verdict of the law that others are compared with."""
NO_LAW = "bound"
"""Verdict of the open-loop bound."""
NOTHING = "none"
"""Verdict of a law without an admissible point."""


def conclude(comparison: ComparedLaws, parts: Iterable[Mapping[str, Array]]) -> Conclusion:
    """Return the table: for every initial condition, limit and band a row for each law, and the bound as the last."""
    table = _Table(comparison, joined(list(parts)))
    records = [
        record
        for condition in comparison.initial_conditions
        for problem in comparison.problems
        for record in table.records(condition, problem)
    ]
    shown = [{name: record[name] for name in SHOWN} for record in records]
    return Conclusion({TABLE: records}, {TABLE: shown}, tuple(findings(comparison, records)), tuple(table.best))


class _Table:
    def __init__(self, comparison: ComparedLaws, rows: Mapping[str, Array]) -> None:
        self._comparison, self._rows = comparison, rows
        self._selection = Selection(comparison, rows)
        scales = comparison.plant.scales
        assert scales is not None
        self._speed, self._acceleration = scales.speed_m_s, 1e3 * scales.acceleration_m_s2
        self._gridded = {name: bool(((rows[PART] == GRID) & (rows[LAW] == name)).any()) for name in comparison.laws}
        self.best: list[dict[str, Any]] = []
        """Best rows of all laws."""

    def records(self, condition: str, problem: Problem) -> list[dict[str, Any]]:
        """Return the rows of one problem."""
        comparison, reference = self._comparison, self._comparison.reference
        found = {name: self._selection.best(name, condition, problem) for name in comparison.laws}
        values = {name: math.inf if row is None else float(row["objective"]) for name, row in found.items()}
        starts = {name: self._selection.of_starts(name, condition, problem) for name in comparison.laws}
        records = []
        for place, name in enumerate(comparison.laws):
            mine = starts[name] if starts[name].size else np.full_like(starts[reference], np.inf)
            paired = paired_ratio(mine, starts[reference], (place,))
            exact = self._gridded[name], self._gridded[reference]
            interval = best_ratio(mine, starts[reference], (place,))
            word = verdict(values[name], values[reference], interval, exact=exact)
            word = NOTHING if found[name] is None else REFERENCE if name == reference else word
            record = self._keys(condition, problem, name) | {"verdict": word} | self._point(found[name], problem)
            record |= {"ratio_to_reference": _ratio(values[name], values[reference])}
            record |= {"ratio_lower": interval[0], "ratio_upper": interval[1]}
            record |= _paired(paired) | self._effort_spent(name, condition, problem, starts[name])
            record |= self._studied(name, condition, problem, found[name]) | self._parameters(name, found[name])
            records.append(record)
            if found[name] is not None:
                self.best.append(dict(found[name] or {}))
        records.append(self._bound(condition, problem, records[0]))
        return records

    def _keys(self, condition: str, problem: Problem, law: str) -> dict[str, Any]:
        return {
            "initial_condition": condition,
            "limit": problem.limit,
            "limit_value": problem.value,
            "threshold_m": problem.threshold_m,
            LAW: law,
        }

    def _point(self, row: Mapping[str, Any] | None, problem: Problem) -> dict[str, Any]:
        """Return what the best row measures."""
        row = row or {}
        time, effort = (
            float(row.get(c, math.nan)) for c in (settling_time_within(problem.threshold_m), "control_effort")
        )
        return {
            "stable": row.get("stable"),
            "objective": float(row.get("objective", math.inf)),
            "settling_time": time,
            "settling_time_orbits": time / (2.0 * math.pi),
            "delta_v_m_per_s": effort * self._speed,
            "peak_acceleration_mm_per_s2": float(row.get(PeakAcceleration.name, math.nan)) * self._acceleration,
            LARGEST_GAIN: float(row.get(LARGEST_GAIN, math.nan)),
            "found_by": row.get(PART),
            "found_for": row.get(LAW),
        }

    def _effort_spent(self, law: str, condition: str, problem: Problem, starts: Floats) -> dict[str, Any]:
        found = starts[np.isfinite(starts)]
        spread = np.quantile(found, [0.0, 0.5, 1.0]).tolist() if found.size else [math.nan] * 3
        own = self._of(law, condition, problem)
        spent = {
            part: int(np.sum(self._rows[EVALUATIONS_SPENT][own & (self._rows[PART] == part)]))
            for part in (SEARCHED, GRID, ONWARD)
        }
        return {
            "starts": len(starts),
            "starts_that_found_a_point": int(found.size),
            "best_start": spread[0],
            "median_start": spread[1],
            "worst_start": spread[2],
            "search_evaluations": spent[SEARCHED],
            "grid_evaluations": spent[GRID],
            "onward_evaluations": spent[ONWARD],
        }

    def _studied(self, law: str, condition: str, problem: Problem, row: Mapping[str, Any] | None) -> dict[str, Any]:
        """Return the objective over other horizons, the worst ones nearby, and the bound for this point."""
        own = self._of(law if row is None else row[LAW], condition, problem)

        def value(part: str, column: str = "objective", also: Any = True) -> float:
            places = np.flatnonzero(own & (self._rows[PART] == part) & also)
            return float(self._rows[column][places[0]]) if places.size else math.nan

        horizons = self._rows["horizon_periods"]
        found = {}
        for periods in self._comparison.report_periods:
            at = horizons == periods
            found[f"objective_over_{periods:g}_periods"] = value(HORIZON, also=at)
            found[f"delta_v_m_per_s_over_{periods:g}_periods"] = value(HORIZON, "control_effort", at) * self._speed
        found |= {f"worst_of_{part}": value(part) for part in (AXES, INTERIOR)}
        found["worst_found_nearby"] = value(WORST)
        return found | {"least_delta_v_m_per_s": value(BOUND, "control_effort") * self._speed}

    def _parameters(self, law: str, row: Mapping[str, Any] | None) -> dict[str, Any]:
        """Return the parameters of a law, NaN for those of others; without a lag it is 0."""
        comparison = self._comparison
        if row is None:
            found: Mapping[str, Any] = {}
        elif row[LAW] == law:
            found = row
        else:
            found = comparison.law_of(law).point_of(comparison.law_of(row[LAW]), row, 0.0)
        return {name: float(found.get(name, math.nan)) for name in comparison.design_variables}

    def _bound(self, condition: str, problem: Problem, like: Mapping[str, Any]) -> dict[str, Any]:
        """Return the row of the bound, at the time and within the peak of the best law."""
        places = np.flatnonzero(self._of(OPEN_LOOP, condition, problem) & (self._rows[PART] == BOUND))
        row = {name: values[places[0]] for name, values in self._rows.items()} if places.size else None
        empty = {
            name: 0 if type(value) is int else None if isinstance(value, str | bool) else math.nan
            for name, value in like.items()
        }
        record = (
            empty
            | self._keys(condition, problem, OPEN_LOOP)
            | {"verdict": NO_LAW, "stable": None, "found_by": None, "found_for": None}
        )
        if row is None:
            return record
        point = self._point(row | {"stable": None}, problem)
        kept = ("settling_time", "settling_time_orbits", "delta_v_m_per_s", "peak_acceleration_mm_per_s2")
        return record | {name: point[name] for name in kept} | {"least_delta_v_m_per_s": point["delta_v_m_per_s"]}

    def _of(self, law: str, condition: str, problem: Problem) -> Array:
        rows = self._rows
        own: Array = (rows[LAW] == law) & (rows["initial_condition"] == condition) & (rows["limit"] == problem.limit)
        own &= (rows["limit_value"] == problem.value) & (rows["threshold_m"] == problem.threshold_m)
        return own


def _ratio(value: float, reference: float) -> float:
    return value / reference if math.isfinite(reference) and reference > 0.0 else math.nan


def _paired(ratio: Ratio) -> dict[str, Any]:
    return {
        "pairs": ratio.pairs,
        "paired_ratio": ratio.middle,
        "paired_ratio_lower": ratio.lower,
        "paired_ratio_upper": ratio.upper,
    }
