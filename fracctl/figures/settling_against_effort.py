"""Settling time against ΔV of the best laws at equal peak acceleration, and what no control can beat."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from fracctl.figures.compared_laws import BOUND, compared, laws, legend, look, note, panel_title
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import FULL_WIDTH_IN

_PANEL_HEIGHT_IN = 1.75
_SIZES = (9.0, 6.0, 4.2, 2.8)
"""Of the markers, from the widest band to the tightest."""
_TICKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw the best points of each law for all bands, joined, with the least ΔV to come to rest in a given time.

    One row of panels an initial condition, one column a peak acceleration.

    Raises:
        FigureError: the run is no comparison, has no limits on the peak, or no law has a result.
    """
    table = compared(results, selection)
    table = table[(table["limit"] == "peak") & table["law"].isin(laws(results))]
    table = table[np.isfinite(table["settling_time"].astype(float))]
    if table.empty:
        raise FigureError("no law has a result under a limit on the peak acceleration")
    curve = _curve(results, selection)
    peaks = sorted(table["limit_value"].unique())
    names = selection.initial_conditions
    height = 0.9 + _PANEL_HEIGHT_IN * len(names)
    figure = Figure(figsize=(FULL_WIDTH_IN, height), layout="constrained")
    axes = figure.subplots(len(names), len(peaks), squeeze=False, sharey=True, sharex="row")
    for name, line in zip(names, axes, strict=True):
        for peak, ax in zip(peaks, line, strict=True):
            key = {"initial_condition": name, "limit": "peak", "limit_value": peak}
            _panel(ax, results, _of(table, key), _of(curve, key))
            note(ax, panel_title(key))
    axes[0, 0].set_yscale("log")
    axes[0, 0].yaxis.set_major_locator(FixedLocator(_TICKS))
    axes[0, 0].yaxis.set_minor_locator(NullLocator())
    axes[0, 0].yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    for ax in axes[-1]:
        ax.set_xlabel(r"$\Delta V$ (m/s)")
    figure.supylabel(f"Settling time ({results.period_name})", fontsize=9.0)
    bands = "large to small markers: " + ", ".join(f"{band:g}" for band in _bands(table)) + " m"
    further = [Line2D([], [], label="least to come to rest", **BOUND), Line2D([], [], label=bands, linestyle="none")]
    legend(figure, results, further)
    columns = ["initial_condition", "limit", "limit_value", "threshold_m", "law"]
    values = ["settling_time_orbits", "delta_v_m_per_s"]
    return figure, pd.concat([table[columns + values], curve[columns + values]], ignore_index=True)


def _panel(ax: Axes, results: Results, table: pd.DataFrame, curve: pd.DataFrame) -> None:
    rows = curve.sort_values("settling_time_orbits")
    ax.plot(rows["delta_v_m_per_s"], rows["settling_time_orbits"], zorder=1, **BOUND)
    bands = _bands(table)
    for law in laws(results):
        own = table[table["law"] == law].sort_values("threshold_m", ascending=False)
        style = look(results, law)
        ax.plot(
            own["delta_v_m_per_s"],
            own["settling_time_orbits"],
            color=style["color"],
            linewidth=0.7,
            zorder=2,
            alpha=0.7,
        )
        for row in own.to_dict("records"):
            size = _SIZES[min(bands.index(row["threshold_m"]), len(_SIZES) - 1)]
            ax.plot(row["delta_v_m_per_s"], row["settling_time_orbits"], zorder=3, markersize=size, **style)


def _curve(results: Results, selection: Selection) -> pd.DataFrame:
    """Return the bound over times."""
    rows = results.evaluations
    rows = rows[(rows["part"] == "curve") & rows["initial_condition"].isin(selection.initial_conditions)]
    rows = rows[np.isfinite(rows["control_effort"])]
    scales = results.scales
    assert scales is not None
    times = rows[[name for name in rows if str(name).startswith("settling_time_within_")]].max(axis=1)
    curve: pd.DataFrame = rows.assign(
        settling_time_orbits=times / (2.0 * math.pi), delta_v_m_per_s=rows["control_effort"] * scales.speed_m_s
    )
    return curve


def _of(table: pd.DataFrame, key: dict[str, Any]) -> pd.DataFrame:
    found: pd.DataFrame = table[np.logical_and.reduce([table[name] == value for name, value in key.items()])]
    return found


def _bands(table: pd.DataFrame) -> list[float]:
    return sorted(table["threshold_m"].unique().tolist(), reverse=True)
