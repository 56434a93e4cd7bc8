"""What the figures of a flight share: units, settling bands, and the look of optimum and baseline."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fracctl.figures import labels
from fracctl.figures.compared_laws import law_name
from fracctl.figures.curves import Curve
from fracctl.figures.results import Results
from fracctl.figures.style import BLUE, CYCLE, ORANGE

_LINES: dict[str, dict[str, Any]] = {
    "baseline": {"color": ORANGE, "linestyle": (0, (4, 1.6)), "linewidth": 1.1},
    "overall": {"color": BLUE, "linestyle": "-", "linewidth": 1.1},
}


_DASHES: tuple[Any, ...] = ("-", (0, (4, 1.6)), (0, (1, 1.2)), (0, (4, 1.2, 1, 1.2)))


def line(curve: Curve) -> dict[str, Any]:
    """Return the look of a curve."""
    if curve.place is None:
        return _LINES[curve.kind]
    dashes = _DASHES[curve.place // len(CYCLE) % len(_DASHES)]
    return {"color": CYCLE[curve.place % len(CYCLE)], "linestyle": dashes, "linewidth": 1.1}


def label(curve: Curve) -> str:
    """Return what a legend says of a curve."""
    return labels.controller(curve.best) if curve.place is None else law_name(curve.kind)


def bands(results: Results) -> list[float]:
    """Return the settling bands δ that the run measures, dimensionless, the smallest first."""
    found = {results.threshold} if results.threshold is not None else set()
    measure = results.configuration["measures"].get("settling_times")
    if measure is not None and results.scales is not None:
        found |= {float(band) / results.scales.length_m for band in measure["thresholds_m"]}
    return sorted(found)


def metres(results: Results, curves: Sequence[Curve], names: Sequence[str]) -> tuple[float, str]:
    """Return the dimensionless length of the unit that suits the largest of some columns, and its name."""
    assert results.scales is not None
    largest = max(float(np.abs(curve.values(name, curve.times)).max()) for curve in curves for name in names)
    size, word = labels.length_unit(largest * results.scales.length_m)
    return size / results.scales.length_m, word


def largest_acceleration(results: Results) -> float | None:
    """Return the bound of the thrusters, dimensionless, None where there is none."""
    evaluation = results.configuration.get("evaluation") or {}
    craft = results.configuration.get("spacecraft") or {}
    if evaluation.get("largest_control") is not None:
        return float(evaluation["largest_control"])
    if results.scales is None:
        return None
    unit = results.scales.acceleration_m_s2
    if evaluation.get("largest_acceleration_mm_s2") is not None:
        return 1e-3 * float(evaluation["largest_acceleration_mm_s2"]) / unit
    return None if craft.get("thrust_n") is None else float(craft["thrust_n"]) / float(craft["mass_kg"]) / unit
