"""What the algebraic tail of a fractional loop does to a result: sentences for the summary.

For α < 1 and an initial displacement the loop ends in ξ ~ s^(-α), whose control does not integrate: the control
effort depends on the horizon, and a tighter band than the settling time's is left for a long time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from fracctl.evaluation import Evaluation
from fracctl.measures import ControlEffort, SettlingTime
from fracctl.trajectory import Trajectory

TIGHTER = 0.1
"""The band that is looked at, of the one of the settling time."""
LATER = 2.0
"""A tighter band is told of if settling in it takes this many times as long."""
GROWTH = 1e-3
"""Relative growth of the control effort over a second horizon that is told of."""


def notes_on_tails(evaluation: Evaluation, found: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return sentences on the primary objective's optima, and on those of objectives that hold the control effort.

    Args:
        evaluation: solves the optima again over twice the horizon.
        found: results by objective and initial condition, with their `optimum`.
    """
    if not evaluation.has_poles:
        return []
    with_effort = [name for name, columns in evaluation.objectives.items() if "control_effort" in columns]
    notes = []
    for result in found:
        name, condition, optimum = result["objective_name"], result["initial_condition"], result["optimum"]
        looks_at_effort = name in (with_effort or [evaluation.objective])
        if optimum is None or not (looks_at_effort or name == evaluation.objective):
            continue
        design = {variable: float(optimum[variable]) for variable in evaluation.design_variables}
        trajectory = evaluation.solve(design, condition, 2.0 * evaluation.horizon)
        sentences = list(_growth(evaluation, optimum, trajectory)) if looks_at_effort else []
        if name == evaluation.objective:
            sentences += _tighter_band(evaluation, optimum, trajectory)
        notes += [f"{condition}, {name}: {sentence}" for sentence in sentences]
    return notes


def _growth(evaluation: Evaluation, optimum: Mapping[str, Any], trajectory: Trajectory) -> Iterator[str]:
    measures: tuple[Any, ...] = evaluation.measures
    measure = next((measure for measure in measures if isinstance(measure, ControlEffort)), None)
    if measure is None:
        return
    effort = float(optimum["control_effort"])
    growth = float(measure(trajectory)["control_effort"][0]) - effort
    if growth > GROWTH * effort:
        first, last = _turns(evaluation.horizon), _turns(2.0 * evaluation.horizon)
        yield (
            f"the control effort {effort:.5g} grows by {growth:.2g} ({100.0 * growth / effort:.1f} %) from {first} "
            f"to {last} {_turn_name(evaluation)}, for its tail does not integrate: compare it at one horizon only"
        )


def _tighter_band(evaluation: Evaluation, optimum: Mapping[str, Any], trajectory: Trajectory) -> Iterator[str]:
    measures: tuple[Any, ...] = evaluation.measures
    threshold = next((measure.threshold for measure in measures if isinstance(measure, SettlingTime)), None)
    if threshold is None:
        return
    settled = float(optimum["settling_time"])
    tighter = float(SettlingTime(TIGHTER * threshold)(trajectory)["settling_time"][0])
    if tighter > LATER * settled:
        turns = _turn_name(evaluation)
        late = f"only after {_turns(tighter)}" if math.isfinite(tighter) else f"not in {_turns(trajectory.horizon)}"
        yield (
            f"settles to {_length(evaluation, threshold)} after {_turns(settled)} {turns}, "
            f"but to {_length(evaluation, TIGHTER * threshold)} {late}"
        )


def _turns(time: float) -> str:
    return f"{time / (2.0 * math.pi):.3g}"


def _turn_name(evaluation: Evaluation) -> str:
    return "periods" if evaluation.plant.scales is None else "orbits"


def _length(evaluation: Evaluation, value: float) -> str:
    scales = evaluation.plant.scales
    return f"{value:g}" if scales is None else f"{scales.length_m * value:g} m"
