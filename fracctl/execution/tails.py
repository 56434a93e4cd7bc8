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
    """Return sentences on the optima of the primary objective, and on those that minimise control effort.

    Args:
        evaluation: solves them again over twice the horizon.
        found: results by objective and initial condition, with their `optimum`.
    """
    notes: dict[str, None] = {}
    for result in found:
        optimum, name = result["optimum"], result["objective_name"]
        if optimum is None or not (name == evaluation.objective or "control_effort" in evaluation.objectives[name]):
            continue
        condition = result["initial_condition"]
        design = {variable: float(optimum[variable]) for variable in evaluation.design_variables}
        trajectory = evaluation.solve(design, condition, 2.0 * evaluation.horizon)
        notes |= dict.fromkeys(f"{condition}: {text}" for text in _sentences(evaluation, optimum, trajectory))
    return list(notes)


def _sentences(evaluation: Evaluation, optimum: Mapping[str, Any], trajectory: Trajectory) -> Iterator[str]:
    measures: tuple[Any, ...] = evaluation.measures
    for measure in measures:
        if isinstance(measure, ControlEffort):
            yield from _growth(evaluation, float(optimum["control_effort"]), trajectory)
        elif isinstance(measure, SettlingTime):
            yield from _tighter_band(evaluation, measure, float(optimum["settling_time"]), trajectory)


def _growth(evaluation: Evaluation, effort: float, trajectory: Trajectory) -> Iterator[str]:
    (longer,) = ControlEffort()(trajectory)["control_effort"]
    growth = float(longer) - effort
    if growth > GROWTH * effort:
        first, last = (_turns(evaluation, time) for time in (evaluation.horizon, 2.0 * evaluation.horizon))
        share = 100.0 * growth / effort
        yield (
            f"the control effort {effort:.5g} grows by {growth:.2g} ({share:.1f} %) from {first} to {last}: "
            "its tail does not integrate, so compare it at one horizon only"
        )


def _tighter_band(
    evaluation: Evaluation, measure: SettlingTime, settling_time: float, trajectory: Trajectory
) -> Iterator[str]:
    threshold = TIGHTER * measure.threshold
    (tighter,) = SettlingTime(threshold)(trajectory)["settling_time"]
    if tighter > LATER * settling_time:
        band, given = (_length(evaluation, value) for value in (threshold, measure.threshold))
        when = f"after {_turns(evaluation, float(tighter))}" if math.isfinite(tighter) else "not"
        limit = f" within {_turns(evaluation, 2.0 * evaluation.horizon)}" if math.isinf(tighter) else ""
        yield f"settles to {given} after {_turns(evaluation, settling_time)}, but to {band} {when}{limit}"


def _turns(evaluation: Evaluation, time: float) -> str:
    unit = "periods" if evaluation.plant.scales is None else "orbits"
    return f"{time / (2.0 * math.pi):.3g} {unit}"


def _length(evaluation: Evaluation, value: float) -> str:
    scales = evaluation.plant.scales
    return f"{value:g}" if scales is None else f"{scales.length_m * value:g} m"
