"""The objective over two orders, each point with the best gains found for it (Figures 6 and 8 of the paper)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection, chosen, objective_scale, optimum
from fracctl.figures.style import FULL_WIDTH_IN, GREEN, ORANGE, STAR

_PANEL_HEIGHT_IN = 2.55
_MOST_COLUMNS = 2
_COLOUR_MAP = "Blues_r"
"""Blue, to tell these figures over orders from those over gains."""
_BEST: dict[str, Any] = {**STAR, "color": GREEN, "markersize": 13.0}
_BASELINE: dict[str, Any] = {**STAR, "marker": "D", "color": ORANGE, "markersize": 7.0}


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw filled contours with a star at the best orders and a diamond at the baseline, one panel a start.

    Points without an optimum are left white.

    Raises:
        FigureError: the optima have no slices over two orders.
    """
    slices = {name: chosen(results.optima, selection, name, "slice") for name in selection.initial_conditions}
    x, y = _orders(pd.concat(slices.values()))
    columns = min(len(slices), _MOST_COLUMNS)
    rows = -(-len(slices) // columns)
    width = FULL_WIDTH_IN * (1.0 if columns > 1 else 0.6)
    figure = Figure(figsize=(width, _PANEL_HEIGHT_IN * rows + 0.35), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    scale, title = objective_scale(results, selection)
    for ax, (name, table) in zip(axes, slices.items(), strict=False):
        contours = _panel(ax, table, selection.value_column, scale, (x, y))
        _marks(ax, results, selection, name, (x, y), scale)
        figure.colorbar(contours, ax=ax, pad=0.02, aspect=24).set_label(title)
        ax.set_xlabel(f"Order ${labels.symbol(x)}$")
        ax.set_ylabel(f"Order ${labels.symbol(y)}$")
    for ax in axes[len(slices) :]:
        ax.set_axis_off()
    handles = [Line2D([], [], label="best orders", **_BEST), Line2D([], [], label="baseline", **_BASELINE)]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    shown = ["initial_condition", x, y, selection.value_column, *selection.columns, "status"]
    table = pd.concat(slices.values(), ignore_index=True)
    return figure, table[list(dict.fromkeys(shown))].sort_values(["initial_condition", x, y])


def _orders(table: pd.DataFrame) -> tuple[str, str]:
    varied = [name for name in map(str, table.columns) if name.startswith("alpha_") and table[name].nunique() > 1]
    if len(varied) != 2:
        found = " and ".join(varied) or "none"
        raise FigureError(f"contours over orders need optima for slices of two orders; this run varies {found}")
    return varied[0], varied[1]


def _panel(ax: Axes, table: pd.DataFrame, column: str, scale: float, names: tuple[str, str]) -> QuadContourSet:
    field = table.pivot(index=names[1], columns=names[0], values=column)
    values = np.ma.masked_invalid(field.to_numpy(dtype=float) / scale)
    x, y = field.columns.to_numpy(float), field.index.to_numpy(float)
    levels: Floats = np.asarray(MaxNLocator(nbins=12).tick_values(float(values.min()), float(values.max())))
    contours = ax.contourf(x, y, values, levels=levels, cmap=_COLOUR_MAP)
    ax.contour(x, y, values, levels=levels, colors="white", linewidths=0.25, alpha=0.6)
    return contours


def _marks(
    ax: Axes, results: Results, selection: Selection, initial_condition: str, names: tuple[str, str], scale: float
) -> None:
    best = optimum(results, selection, initial_condition, "overall")
    baseline = optimum(results, selection, initial_condition, "baseline")
    title = labels.initial_condition(initial_condition)
    if best is not None:
        at = ", ".join(f"{best[name]:g}" for name in names)
        title += f": {best[selection.value_column] / scale:#.4g} at ({at})"
        ax.plot(best[names[0]], best[names[1]], clip_on=False, zorder=5, **_BEST)
    if baseline is not None:
        ax.plot(baseline[names[0]], baseline[names[1]], clip_on=False, zorder=4, **_BASELINE)
        if best is not None:
            change = 100.0 * (best[selection.value_column] / baseline[selection.value_column] - 1.0)
            title += f", {change:+.1f} %".replace("-", "−")
    ax.set_title(title)
