"""Rows solved again by an independent solver: the proof that a survey's numbers do not hang on one method."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.evaluation import Evaluation
from fracctl.solvers.base import Solver
from fracctl.solvers.solve import make_solver
from fracctl.surveys.base import Rows
from fracctl.trajectory import Trajectory

SAMPLES = 401
"""Times at which two trajectories are compared, uniform from 0 to the horizon."""
_BATCH = 1024
_CHECKED = ("ok", "unsettled")


@dataclass
class CrossCheck:
    """Differences between two solvers on a random share of the rows and on all optima.

    The solvers disagree where positions or controls differ, relative to their peaks, by more than ten times the
    tolerance and by more than both error estimates together.

    Args:
        evaluation: its solver says which share of the rows is checked, and by which solver; none for a share of 0.
        seed: of the choice; the same rows are chosen whatever the scheduler.
    """

    evaluation: Evaluation
    seed: int
    rows: int = 0
    """Rows solved again so far."""
    worst: float = 0.0
    """Largest difference relative to the peak."""
    disagreements: list[str] = field(default_factory=list)
    """A sentence for each row on which the solvers disagree."""

    def __post_init__(self) -> None:
        self._random = np.random.default_rng(self.seed)
        self._share = self.evaluation.solver.cross_check
        self._second: Solver | None = make_solver(self.evaluation.solver.checked_by) if self._share else None

    def add(self, rows: Rows) -> None:
        """Check a random share of further rows, which come in the order of the table."""
        if self._second is None:
            return
        chosen = self._random.random(len(rows["status"])) < self._share
        stable = np.array([verdict is True for verdict in rows["stable"]], dtype=bool)
        self._check(rows, np.flatnonzero(chosen & stable & np.isin(rows["status"], _CHECKED)))

    def add_optima(self, optima: Iterable[Mapping[str, Any]]) -> None:
        """Check all optima."""
        if self._second is None:
            return
        found = [row for row in optima if row["stable"] is True]
        if found:
            self._check({name: np.array([row[name] for row in found]) for name in found[0]}, np.arange(len(found)))

    def notes(self) -> list[str]:
        """Return a sentence on what came out."""
        if self._second is None:
            return []
        worst = f"worst difference {self.worst:.1e} of the peak"
        return [f"cross-check: {self.rows} rows solved by {self._second.name} too, {worst}"]

    def summary(self) -> dict[str, Any]:
        """Return what the summary of the run says of it; a disagreement fails the run."""
        if self._second is None:
            return {}
        found = {"solver": self._second.name, "rows": self.rows, "worst_difference": self.worst}
        if not self.disagreements:
            return {"cross_check": found | {"disagreements": 0}}
        count = len(self.disagreements)
        error = f"{count} of {self.rows} rows that two solvers computed do not agree, e.g. {self.disagreements[0]}"
        return {"cross_check": found | {"disagreements": count}, "status": "failed", "error": error}

    def _check(self, rows: Mapping[str, Array], chosen: Array) -> None:
        """Check rows of all initial conditions together: those of equal orders share most of the work."""
        for evaluation, places in self.evaluation.by_law(rows):
            own = np.intersect1d(chosen, places)
            for start in range(0, len(own), _BATCH):
                part = own[start : start + _BATCH]
                names = rows["initial_condition"][part].tolist()
                self._compare(evaluation, names, {name: rows[name][part] for name in evaluation.design_variables})

    def _compare(self, evaluation: Evaluation, conditions: Sequence[str], design: Mapping[str, Floats]) -> None:
        states = np.stack([evaluation.initial_conditions[name] for name in conditions])
        loop = evaluation.loop({name: np.asarray(values, dtype=np.float64) for name, values in design.items()})
        first = evaluation.solver.solve(loop, states, evaluation.horizon)
        assert self._second is not None
        second = self._second.solve(loop, states, evaluation.horizon)
        difference = _difference(first, second)
        allowed = np.maximum(10.0 * self.evaluation.solver.tolerance, first.error_estimate + second.error_estimate)
        self.rows += len(difference)
        self.worst = max(self.worst, float(np.max(difference)))
        for i in np.flatnonzero(~(difference <= allowed)).tolist():
            point = ", ".join(f"{name} = {float(values[i]):g}" for name, values in design.items())
            self.disagreements.append(
                f"{conditions[i]}, {point}: {self.evaluation.solver.name} and {self._second.name} differ by"
                f" {difference[i]:.1e} of the peak"
            )


def _difference(first: Trajectory, second: Trajectory) -> Floats:
    """Largest difference of positions and of controls over their peaks, (b,)."""
    times = np.linspace(0.0, first.horizon, SAMPLES)
    m = first.positions.shape[1]
    pairs = [(first(times)[..., :m], second(times)[..., :m]), (first.control(times), second.control(times))]
    parts = []
    for one, other in pairs:
        peak = np.maximum(np.abs(one).max(axis=(-2, -1)), 1e-300)
        parts.append(np.abs(one - other).max(axis=(-2, -1)) / peak)
    worst: Floats = np.max(np.atleast_2d(parts), axis=0)
    return np.atleast_1d(worst)
