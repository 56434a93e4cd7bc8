"""The optimised objective against the order of the derivative (Figure 4 of the paper)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Row, Selection, chosen, objective_scale, optimum
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, GREEN, GREY, STAR

_PANEL_HEIGHT_IN = 1.55
_MARGIN_HEIGHT_IN = 0.75
_SLICES: dict[str, Any] = {"marker": "o", "color": BLUE, "markersize": 3.0, "linewidth": 1.0}
_BEST: dict[str, Any] = {**STAR, "color": GREEN, "markersize": 12.0}
_BASELINE: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": (0, (4, 3))}


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw the optimum of each slice, a star at the best and a line at the baseline; one panel an initial condition.

    Raises:
        FigureError: the survey has no slices, or no slice has an optimum.
    """
    if results.slice_variable is None:
        raise FigureError("the survey has no `slice`, so there is nothing to draw against")
    slices = {name: _slices(results, selection, name) for name in selection.initial_conditions}
    height = _PANEL_HEIGHT_IN * len(slices) + _MARGIN_HEIGHT_IN
    figure = Figure(figsize=(0.62 * FULL_WIDTH_IN, height), layout="constrained")
    axes = figure.subplots(len(slices), 1, squeeze=False, sharex=True)[:, 0]
    scale, title = objective_scale(results, selection)
    for (name, rows), ax in zip(slices.items(), axes, strict=True):
        _panel(ax, rows, results, selection, name, scale)
    axes[-1].set_xlabel(f"Order of the derivative ${labels.symbol(results.slice_variable)}$")
    figure.supylabel(title, fontsize=9.0)
    figure.legend(handles=_handles(results, selection), loc="outside lower center", ncols=3, columnspacing=1.2)
    return figure, pd.concat(slices.values(), ignore_index=True)


def _slices(results: Results, selection: Selection, initial_condition: str) -> pd.DataFrame:
    rows = chosen(results.optima, selection, initial_condition, "slice").sort_values("slice")
    if rows.empty or not np.isfinite(rows[selection.value_column]).any():
        raise FigureError(f"no slice of '{initial_condition}' has an optimum of {selection.objective}")
    return rows


def _panel(
    ax: Axes, rows: pd.DataFrame, results: Results, selection: Selection, initial_condition: str, scale: float
) -> None:
    order, value = rows["slice"].to_numpy(float), rows[selection.value_column].to_numpy(float) / scale
    finite = np.isfinite(value)
    ax.plot(order[finite], value[finite], **_SLICES)
    baseline = optimum(results, selection, initial_condition, "baseline")
    best = optimum(results, selection, initial_condition, "overall")
    if baseline is not None:
        ax.axhline(baseline[selection.value_column] / scale, zorder=0, **_BASELINE)
    if best is not None:
        ax.plot(best[str(results.slice_variable)], best[selection.value_column] / scale, zorder=5, **_BEST)
        ax.set_title(_note(best, baseline, results, selection), loc="right")
    ax.set_title(labels.initial_condition(initial_condition), loc="left", fontweight="bold")
    ax.margins(x=0.03, y=0.16)


def _note(best: Row, baseline: Row | None, results: Results, selection: Selection) -> str:
    cut, column = str(results.slice_variable), selection.value_column
    note = f"best at ${labels.symbol(cut)} = {best[cut]:g}$"
    if baseline is None or best[cut] == baseline[cut]:
        return note
    return f"{note}, {100.0 * (best[column] / baseline[column] - 1.0):+.1f} %".replace("-", "−")


def _handles(results: Results, selection: Selection) -> list[Line2D]:
    handles = [Line2D([], [], label="best gains of each order", **_SLICES), Line2D([], [], label="best order", **_BEST)]
    if all(optimum(results, selection, name, "baseline") is None for name in selection.initial_conditions):
        return handles
    fixed = results.configuration["survey"].get("baseline", {})
    names = ", ".join(f"${labels.symbol(name)} = {value:g}$" for name, value in fixed.items())
    return [*handles, Line2D([], [], label=f"baseline {names}", **_BASELINE)]
