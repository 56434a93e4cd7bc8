"""Trajectories and control signals of the baseline and of the overall optimum (Figures 3 and 5 of the paper)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of, table_of
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, GREY, ORANGE, STAR
from fracctl.plants.capabilities import AngularPlant

_PANEL_HEIGHT_IN = 2.15
_MARGIN_HEIGHT_IN = 0.6
_SHOWN = 2.2
"""The time axis ends at this many times the longest settling time."""
_BAND_SHOWN = 4.0
"""The inset shows this many half widths δ to either side of 0."""
_POINTS = 801
_POINTS_IN_PERIOD = 60
_LINES: dict[str, dict[str, Any]] = {
    "baseline": {"color": ORANGE, "linestyle": (0, (4, 1.6))},
    "overall": {"color": BLUE, "linestyle": "-"},
}


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw states (left) and controls (right), baseline dashed, optimum solid.

    Each initial condition and component has a row. The ±δ band is dotted, stars mark the settling times; the outer
    axes are in SI units where the plant has scales.

    Raises:
        FigureError: the run holds no trajectory of an optimum.
    """
    curves = {name: curves_of(results, selection, name) for name in selection.initial_conditions}
    rows = [(name, component) for name in curves for component in results.components]
    figure = Figure(figsize=(FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(rows) + _MARGIN_HEIGHT_IN), layout="constrained")
    axes = figure.subplots(len(rows), 2, squeeze=False, sharex=True)
    times = np.linspace(0.0, _end(results, [curve for pair in curves.values() for curve in pair]), _points(results))
    for (name, component), (left, right) in zip(rows, axes, strict=True):
        _state(left, curves[name], component, results, times)
        _control(right, curves[name], component, results, times)
        left.set_ylabel(f"{labels.initial_condition(name)}: {left.get_ylabel()}")
    for ax in axes[-1]:
        ax.set_xlabel(results.time_name)
    for ax in axes[0]:
        top = ax.secondary_xaxis("top", functions=_scaling(1.0 / math.tau))
        top.set_xlabel(f"Time ({results.period_name})")
    return figure, table_of(curves)


def _points(results: Results) -> int:
    return max(_POINTS, round(_POINTS_IN_PERIOD * results.horizon_periods))


def _end(results: Results, curves: Sequence[Curve]) -> float:
    horizon = math.tau * results.horizon_periods
    finite = [curve.settling_time for curve in curves if math.isfinite(curve.settling_time)]
    return min(horizon, _SHOWN * max(finite)) if finite else horizon


def _state(ax: Axes, curves: Sequence[Curve], component: str, results: Results, times: Floats) -> None:
    symbol, peak = labels.symbol(component), _peak(curves, component) or results.threshold or 0.0
    factor, note = labels.power_of_ten(peak)
    angle = " (rad)" if isinstance(results.plant, AngularPlant) and component in results.plant.angles else ""
    ax.set_ylabel(f"position ${symbol}$" + angle + note)
    _draw(ax, curves, component, results.threshold, times, factor)
    if results.scales is not None:
        metres = results.scales.length_m
        _outer_axis(ax, factor * metres, labels.length_unit(peak * metres), f"${symbol}\\,r$")
    if results.threshold is not None and peak > 2.0 * _BAND_SHOWN * results.threshold:
        _inset(ax, curves, component, results, times)


def _control(ax: Axes, curves: Sequence[Curve], component: str, results: Results, times: Floats) -> None:
    column = f"control_{component}"
    symbol, peak = labels.symbol(column), _peak(curves, column)
    factor, note = labels.power_of_ten(peak)
    ax.set_ylabel(f"Control ${symbol}$" + note)
    _draw(ax, curves, column, None, times, factor)
    ax.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
    ax.legend(loc="best")
    if results.scales is not None:
        unit = results.scales.acceleration_m_s2
        _outer_axis(ax, factor * unit, labels.acceleration_unit(peak * unit), f"${symbol}\\,rn^2$")


def _draw(
    ax: Axes, curves: Sequence[Curve], column: str, threshold: float | None, times: Floats, factor: float
) -> None:
    """Draw the curves, the ±δ band and the stars, divided by `factor`."""
    for curve in curves:
        label = labels.controller(curve.best)
        if curve.kind == "baseline" and len(curves) == 1 and "delay" not in curve.best:
            label += "\n(no other order does better)"
        ax.plot(times, curve.values(column, times) / factor, label=label, **_LINES[curve.kind])
    ax.set_xlim(0.0, times[-1])
    if threshold is None:
        return
    for level in (-threshold, threshold):
        ax.axhline(level / factor, color="black", linestyle=":", linewidth=0.8, zorder=1)
    for curve in curves:
        if curve.last_to_settle(threshold) == column:
            place = curve.values(column, np.array([curve.settling_time])) / factor
            ax.plot(curve.settling_time, place, color=_LINES[curve.kind]["color"], markersize=10, zorder=4, **STAR)


def _inset(ax: Axes, curves: Sequence[Curve], component: str, results: Results, times: Floats) -> None:
    threshold = results.threshold or 0.0
    samples = np.concatenate([curve.values(component, curve.times) for curve in curves])
    above = samples[np.argmax(np.abs(samples))] > 0.0
    inset = ax.inset_axes((0.42, 0.40 if above else 0.12, 0.55, 0.46))
    _draw(inset, curves, component, threshold, times, 1.0)
    half = _BAND_SHOWN * threshold
    inset.set_xlim(min(curve.last_time_above(component, half) for curve in curves), times[-1])
    inset.set_ylim(-half, half)
    inset.set_yticks([-threshold, threshold], [r"$-\delta$", r"$+\delta$"])
    inset.tick_params(labelsize=7)
    note = f"$\\delta = {labels.number(threshold)}$"
    if results.scales is not None:
        size, unit = labels.length_unit(threshold * results.scales.length_m)
        note += f" ({threshold * results.scales.length_m / size:.4g} {unit})"
    inset.set_title(note, fontsize=7, pad=2.0)


def _outer_axis(ax: Axes, factor: float, unit: tuple[float, str], symbol: str) -> None:
    size, name = unit
    outer = ax.secondary_yaxis("right", functions=_scaling(factor / size))
    outer.set_ylabel(f"{symbol} ({name})")


def _scaling(factor: float) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    return lambda value: value * factor, lambda value: value / factor


def _peak(curves: Sequence[Curve], column: str) -> float:
    return max(float(np.abs(curve.values(column, curve.times)).max()) for curve in curves)
