"""What a worker does for a cross-check: solve rows by two solvers, and compare the trajectories."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Floats
from fracctl.evaluation import Evaluation
from fracctl.execution.worker import Work, describe
from fracctl.solvers.solve import make_solver
from fracctl.surveys.base import Rows
from fracctl.trajectory import Trajectory

SAMPLES = 401
"""Times at which two trajectories are compared, uniform from 0 to the horizon."""


@dataclass(frozen=True)
class Found:
    """What came out of some rows."""

    rows: int
    """How many were solved again."""
    worst: float = 0.0
    """Largest difference relative to the peak."""
    disagreements: tuple[str, ...] = ()
    """A sentence for each row on which the solvers disagree."""
    reason: str | None = None
    """Why they could not be solved, in one line; None if they were."""
    trace: str = ""
    """Where that failed, for the log."""
    cpu_time_s: float = 0.0
    """CPU time it took."""
    process: int = 0
    """Process that it ran in."""


def solve_again(work: Work, rows: Rows) -> Found:
    """Compare all of some rows, each by its law; whatever goes wrong becomes a reason."""
    started = time.process_time()
    try:
        parts = [
            _compared(law, {name: values[places] for name, values in rows.items()})
            for law, places in work.evaluation().by_law(rows)
            if len(places)
        ]
    except (Exception, SystemExit) as problem:  # noqa: BLE001 - fails the run, with its reason
        return Found(0, reason=describe(problem), trace=traceback.format_exc())
    return Found(
        sum(part.rows for part in parts),
        max((part.worst for part in parts), default=0.0),
        tuple(sentence for part in parts for sentence in part.disagreements),
        cpu_time_s=time.process_time() - started,
        process=os.getpid(),
    )


def _compared(evaluation: Evaluation, rows: Rows) -> Found:
    conditions: Sequence[str] = rows["initial_condition"].tolist()
    design = {name: np.asarray(rows[name], dtype=np.float64) for name in evaluation.design_variables}
    states = np.stack([evaluation.initial_conditions[name] for name in conditions])
    loop, solver = evaluation.loop(design), evaluation.solver
    second = make_solver(solver.checked_by)
    one, other = (some.solve(loop, states, evaluation.horizon) for some in (solver, second))
    difference = _difference(one, other)
    allowed = np.maximum(10.0 * solver.tolerance, one.error_estimate + other.error_estimate)
    sentences = (
        f"{conditions[i]}, {_point(design, i)}: {solver.name} and {second.name} differ by"
        f" {difference[i]:.1e} of the peak"
        for i in np.flatnonzero(~(difference <= allowed)).tolist()
    )
    return Found(len(difference), float(np.max(difference)), tuple(sentences))


def _point(design: Mapping[str, Floats], i: int) -> str:
    return ", ".join(f"{name} = {float(values[i]):g}" for name, values in design.items())


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
