"""Errors of the solvers against their nodes, and against the time that they take."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, NullLocator, ScalarFormatter

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, GREEN, GREY, ORANGE

_HEIGHT_IN = 3.9
_LEAST = 1e-13
"""Smaller errors are rounding, and drawn there."""
_SOLVERS: dict[str, dict[str, Any]] = {
    "collocation": {"color": ORANGE, "marker": "o"},
    "volterra": {"color": GREEN, "marker": "s"},
    "contour": {"color": BLUE, "marker": "D"},
}
_THEORY: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": (0, (4, 3)), "zorder": 1}
_APART = 3.0
"""Factor by which the slopes of theory are drawn beside the curves."""
_DASHED = (0, (2.5, 1.5))
_ORDER_COLOURS = "YlOrBr"


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw errors against nodes from the first initial condition, and against CPU time from all.

    On the left collocation has a curve for each order, with the slopes that theory gives to the smallest and the
    largest fractional one; the other solvers show the largest error over the orders. On the right all three do.

    Raises:
        FigureError: the run holds no errors of solvers.
    """
    table = _table(results, selection)
    figure = Figure(figsize=(FULL_WIDTH_IN, _HEIGHT_IN), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    first = selection.initial_conditions[0]
    _against_nodes(left, table[table["initial_condition"] == first], _leading_power(results, first))
    left.set_title(f"{labels.initial_condition(first)}, volterra and contour at their worst order", loc="left")
    _against_time(right, table, selection.initial_conditions)
    right.set_title("All at their worst order", loc="left")
    handles, _ = left.get_legend_handles_labels()
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=7.5, columnspacing=1.4)
    left.set_ylabel("Error of the position / peak")
    left.set_ylim(0.3 * _LEAST, 0.1)
    left.yaxis.set_major_locator(LogLocator(numticks=8))
    for ax in (left, right):
        ax.yaxis.set_minor_locator(NullLocator())
        ax.grid(axis="y", linewidth=0.3, color="0.88")
    return figure, table


def _table(results: Results, selection: Selection) -> pd.DataFrame:
    """Largest errors and median times by initial condition, order, solver and resolution."""
    rows = results.evaluations
    if "seconds_per_trajectory" not in rows:
        raise FigureError("errors of the solvers need `evaluation: accuracy`; this run has other columns")
    orders = [name for name in rows if str(name).startswith("alpha_")]
    rows = rows.assign(order=rows[orders].max(axis=1) if orders else 1.0)
    rows = rows[rows["initial_condition"].isin(selection.initial_conditions)].dropna(subset=["error"])
    if rows.empty:
        raise FigureError("no trajectory has been compared")
    grouped = rows.groupby(["initial_condition", "order", "solver", "resolution"], sort=True, as_index=False)
    return grouped.agg(
        {
            "error": "max",
            "control_error": "max",
            "error_estimate": "max",
            "nodes": "median",
            "seconds_per_trajectory": "median",
        }
    )


def _leading_power(results: Results, initial_condition: str) -> float:
    """Exponent of the first non-integer power of time, plus the order: 3 with an initial rate, otherwise 4."""
    state = results.configuration["initial_condition"][initial_condition]
    alphas = [str(name) for name in results.evaluations if str(name).startswith("alpha_")]
    return 3.0 if any(state.get(f"{name.removeprefix('alpha_')}_dot") for name in alphas) else 4.0


def _against_nodes(ax: Axes, table: pd.DataFrame, power: float) -> None:
    collocation = table[table["solver"] == "collocation"]
    orders = np.sort(collocation["order"].unique())
    shades = colormaps[_ORDER_COLOURS](np.linspace(0.35, 0.95, len(orders)))
    for order, colour in zip(orders, shades, strict=True):
        rows = collocation[collocation["order"] == order].sort_values("resolution")
        nodes, errors = rows["resolution"].to_numpy(float), _drawn(rows["error"])
        label = rf"collocation, $\alpha = {order:g}$"
        ax.loglog(nodes, errors, marker="o", markersize=3.5, linewidth=1.0, color=colour, label=label, zorder=3)
    fractional = orders[orders < 1.0]
    for order, factor in [(fractional[-1], _APART), (fractional[0], 1.0 / _APART)] if len(fractional) else []:
        _slope(ax, collocation[collocation["order"] == order], power, order, factor)
    for solver in ("volterra", "contour"):
        rows = _worst(table[table["solver"] == solver])
        nodes = rows["resolution"] if solver == "volterra" else rows["nodes"]
        if rows.empty:
            continue
        label = "volterra, $N$ a panel" if solver == "volterra" else "contour, nodes of all contours"
        ax.loglog(nodes, _drawn(rows["error"]), markersize=3.5, linewidth=1.0, label=label, **_SOLVERS[solver])
    ax.set_xlabel("Nodes $N$")
    ax.xaxis.set_major_locator(FixedLocator([8, 16, 32, 64, 128, 256, 512, 1024]))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.xaxis.set_minor_locator(NullLocator())
    if len(fractional):
        term = rf"$N^{{-2({power - 1.0:g} - \alpha)}}$ of the term $s^{{{power:g} - \alpha}}$"
        ax.plot([], [], label=term, **_THEORY)


def _slope(ax: Axes, rows: pd.DataFrame, power: float, order: float, factor: float) -> None:
    """Draw the theoretical decrease beside the last points of a curve, and write its exponent to it."""
    last = rows.sort_values("resolution").iloc[-1]
    end, rate = float(last["resolution"]), -2.0 * (power - order - 1.0)
    nodes = np.array([min(max(float(rows["resolution"].min()), 0.06 * end), end), end])
    errors = factor * float(last["error"]) * (nodes / end) ** rate
    ax.loglog(nodes, errors, **_THEORY)
    above = factor > 1.0
    middle = (float(np.sqrt(nodes.prod())), float(np.sqrt(errors.prod())))
    ax.annotate(
        rf"$N^{{{rate:.2f}}}$ ($\alpha = {order:g}$)".replace("-", "\u2212"),
        middle,
        xytext=(2.0 if above else -2.0, 1.0 if above else -1.0),
        textcoords="offset points",
        fontsize=7.5,
        color=GREY,
        ha="left" if above else "right",
        va="bottom" if above else "top",
    )


def _against_time(ax: Axes, table: pd.DataFrame, initial_conditions: tuple[str, ...]) -> None:
    for solver, look in _SOLVERS.items():
        for place, name in enumerate(initial_conditions):
            rows = _worst(table[(table["solver"] == solver) & (table["initial_condition"] == name)])
            if rows.empty:
                continue
            fill = {"linestyle": _DASHED, "markerfacecolor": "white"} if place else {}
            micro = 1e6 * rows["seconds_per_trajectory"]
            ax.loglog(micro, _drawn(rows["error"]), markersize=3.5, linewidth=1.0, **look, **fill)
    handles = [Line2D([], [], label=solver, linewidth=1.0, **look) for solver, look in _SOLVERS.items()]
    for place, name in enumerate(initial_conditions):
        style: dict[str, Any] = {"linestyle": _DASHED if place else "-", "color": GREY, "linewidth": 1.0}
        handles.append(Line2D([], [], label=labels.initial_condition(name), **style))
    ax.legend(handles=handles, loc="upper right", fontsize=7.0)
    ax.set_xlabel("CPU time per trajectory in a batch (µs)")


def _worst(rows: pd.DataFrame) -> pd.DataFrame:
    """Largest error over the orders at each resolution, with the median of times and nodes."""
    columns = {"error": "max", "nodes": "median", "seconds_per_trajectory": "median"}
    return rows.groupby("resolution", sort=True, as_index=False).agg(columns)


def _drawn(errors: pd.Series[float]) -> Floats:
    return np.maximum(errors.to_numpy(float), _LEAST)
