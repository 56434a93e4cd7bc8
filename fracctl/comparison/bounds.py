"""What no control can beat: the least effort to come to rest in a given time under a given peak."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.comparison.compared import ComparedLaws
from fracctl.comparison.laws import LARGEST_GAIN
from fracctl.comparison.problems import PART, Problem, settling_time_within
from fracctl.design.open_loop import least_effort
from fracctl.evaluation import Evaluation
from fracctl.measures import PeakAcceleration
from fracctl.surveys.base import EVALUATIONS_SPENT, POINT, SEARCHED_FOR

BOUND, CURVE = "bound", "curve"
"""Parts of the study: at the time and the peak of a law's best point, and over times at one peak."""
INFEASIBLE = "infeasible"
"""Status where no control within the peak comes to rest in the time."""
_SEGMENTS = 200


@dataclass(frozen=True)
class Case:
    """A time and a peak."""

    law: str
    """Whose they are."""
    part: str
    problem: Problem
    time: float
    """Dimensionless."""
    peak: float
    """Dimensionless."""


@dataclass(frozen=True)
class OpenLoopBounds:
    """Bounds the control effort of cases from below, for one initial condition."""

    initial_condition: str
    cases: tuple[Case, ...]

    def __call__(self, evaluation: Evaluation, starts: Mapping[str, Floats]) -> dict[str, Array]:
        """Return a row for each case: its time as the settling time, the peak, the least control effort."""
        assert isinstance(evaluation, ComparedLaws)
        state = evaluation.initial_conditions[self.initial_condition]
        found = [least_effort(evaluation.plant, state, case.time, case.peak, _SEGMENTS) for case in self.cases]
        count = len(self.cases)
        columns: dict[str, Array] = {
            "initial_condition": np.full(count, self.initial_condition, dtype=object),
            PeakAcceleration.name: np.array([case.peak for case in self.cases]),
            "control_effort": np.array([np.inf if one is None else one.lower_bound for one in found]),
            LARGEST_GAIN: np.full(count, np.nan),
            "status": np.array([INFEASIBLE if one is None else "ok" for one in found], dtype=object),
            "stable": np.full(count, None, dtype=object),
            "nodes": np.full(count, _SEGMENTS),
        }
        names = {f"objective_{problem.objective}" for problem in evaluation.problems}
        columns |= {name: np.full(count, np.nan) for name in names} | dict(starts)
        for band in evaluation.thresholds_m:
            own = np.array([case.problem.threshold_m == band for case in self.cases])
            columns[settling_time_within(band)] = np.where(own, [case.time for case in self.cases], np.nan)
        table = evaluation.table_rows(columns, "", [case.problem for case in self.cases])
        return table | {
            "law": np.array([case.law for case in self.cases], dtype=object),
            PART: np.array([case.part for case in self.cases], dtype=object),
            EVALUATIONS_SPENT: np.ones(count, dtype=np.int64),
            POINT: np.arange(count),
            SEARCHED_FOR: np.full(count, None, dtype=object),
        }
