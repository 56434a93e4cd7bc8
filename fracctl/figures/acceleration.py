"""What the thrusters do: acceleration by axis with its bound, and the ΔV spent so far."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of
from fracctl.figures.flight import label, largest_acceleration, line
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import FULL_WIDTH_IN, GREY

_PANEL_HEIGHT_IN = 1.55
_SPENT = 0.98
"""The time axis ends where this share of the ΔV is spent."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw a column for each initial condition: a panel for each axis, and below them the cumulative ΔV.

    Dashed lines are the bound of the thrusters, for each axis where it is by axis and of the magnitude otherwise. The
    ΔV is that of thrusters along the axes, Σ_i ∫ |υ_i| ds, by the trapezoidal rule on the stored samples, where the
    measure `delta_v` is exact; of flights it is exact too, for their controls are steps.

    Raises:
        FigureError: the run holds no trajectory of an optimum.
    """
    curves = {name: curves_of(results, selection, name) for name in selection.initial_conditions}
    rows: list[str | None] = [*results.components, None]
    figure = Figure(figsize=(FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(rows) + 0.5), layout="constrained")
    axes = figure.subplots(len(rows), len(curves), squeeze=False, sharex="col", sharey="row")
    for (name, pair), column in zip(curves.items(), axes.T, strict=True):
        for component, ax in zip(results.components, column[:-1], strict=True):
            _axis(ax, pair, component, results)
        _spent_so_far(column[-1], pair, results)
        column[0].set_title(labels.initial_condition(name), loc="left")
        column[-1].set_xlim(0.0, max(_end(curve) for curve in pair) / math.tau)
        column[-1].set_xlabel(f"Time ({results.period_name})")
    for ax, row in zip(axes[:, 0], rows, strict=True):
        ax.set_ylabel(_words(row, results))
    handles, words = axes[-1, 0].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=2)
    return figure, _table(curves, results)


def _words(component: str | None, results: Results) -> str:
    if component is None:
        return r"$\Delta V$ (m/s)" if results.scales else r"$\Delta V$"
    symbol = labels.symbol(f"control_{component}")
    return f"${symbol}\\,rn^2$ (mm/s²)" if results.scales else f"${symbol}$"


def _axis(ax: Axes, curves: Sequence[Curve], component: str, results: Results) -> None:
    unit = 1.0 if results.scales is None else 1e3 * results.scales.acceleration_m_s2
    for curve in curves:
        values = unit * curve.samples[f"control_{component}"].to_numpy(float)
        ax.plot(curve.times / math.tau, values, drawstyle="steps-post" if curve.held else "default", **line(curve))
    ax.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
    bound = largest_acceleration(results)
    for level in () if bound is None else (-unit * bound, unit * bound):
        ax.axhline(level, color="black", linewidth=0.7, linestyle=(0, (5, 3)))


def _spent_so_far(ax: Axes, curves: Sequence[Curve], results: Results) -> None:
    unit = 1.0 if results.scales is None else results.scales.speed_m_s
    for curve in curves:
        ax.plot(curve.times / math.tau, unit * spent(curve), label=label(curve), **line(curve))
    ax.set_ylim(bottom=0.0)


def spent(curve: Curve) -> Floats:
    """Return Σ_i ∫ |υ_i| ds up to each sample, dimensionless."""
    rate = np.sum([np.abs(curve.samples[f"control_{name}"].to_numpy(float)) for name in curve.components], axis=0)
    mean = rate[:-1] if curve.held else 0.5 * (rate[1:] + rate[:-1])
    steps = mean * np.diff(curve.times)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _end(curve: Curve) -> float:
    total = spent(curve)
    late = np.flatnonzero(total < _SPENT * total[-1])
    return float(curve.times[min(late[-1] + 1, len(total) - 1)]) if late.size else float(curve.times[-1])


def _table(curves: Mapping[str, Sequence[Curve]], results: Results) -> pd.DataFrame:
    scales = results.scales
    parts = []
    for name, pair in curves.items():
        for curve in pair:
            columns: dict[str, Any] = {"initial_condition": name, "kind": curve.kind, "periods": curve.times / math.tau}
            for component in curve.components:
                values = curve.samples[f"control_{component}"].to_numpy(float)
                if scales is None:
                    columns[f"control_{component}"] = values
                else:
                    columns[f"acceleration_{component}_mm_s2"] = 1e3 * scales.acceleration_m_s2 * values
            columns["delta_v" if scales is None else "delta_v_m_s"] = spent(curve) * (
                scales.speed_m_s if scales else 1.0
            )
            parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)
