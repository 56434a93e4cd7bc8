"""The largest multiplier against what a survey varies, and the window in which it is below 1."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import BLUE, CYCLE, FULL_WIDTH_IN, GREY

_HEIGHT_IN = 2.6
_LOGARITHMIC = 50.0


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw multipliers left and the periodicity error at the end right, a line for each value of a second axis.

    Raises:
        FigureError: the survey does not vary one or two variables, or multipliers were not measured.
    """
    if len(results.varied) not in (1, 2) or "largest_multiplier" not in results.evaluations:
        raise FigureError("the survey must vary one or two variables, and measure largest_multiplier")
    first, *second = results.varied
    figure = Figure(figsize=(FULL_WIDTH_IN, _HEIGHT_IN * len(selection.initial_conditions)), layout="constrained")
    axes = figure.subplots(len(selection.initial_conditions), 2, squeeze=False)
    columns = ["initial_condition", *results.varied, "largest_multiplier", "periodicity_error", "status"]
    table = results.evaluations[columns]
    for name, (left, right) in zip(selection.initial_conditions, axes, strict=True):
        rows = table[table["initial_condition"] == name]
        groups = rows.groupby(second[0]) if second else [(None, rows)]
        for colour, (value, group) in zip(CYCLE, groups, strict=False):
            label = f"${labels.symbol(second[0])} = {float(str(value)):g}$" if second else None
            x = group[first].to_numpy(float)
            left.plot(x, group["largest_multiplier"], ".-", color=colour, label=label)
            error = group["periodicity_error"].where(group["status"] == "ok").to_numpy(float)
            right.semilogy(x, np.maximum(error, 1e-16), ".-", color=colour, label=label)
        left.axhline(1.0, color=GREY, linewidth=0.8, linestyle=":")
        left.set_ylabel(f"{labels.initial_condition(name)}: largest multiplier")
        right.set_ylabel("periodicity error at the end")
        positive = rows[first][rows[first] > 0.0]
        for ax in (left, right):
            ax.set_xlabel(f"${labels.symbol(first)}$")
            if len(positive) and len(positive) == len(rows) and positive.max() > _LOGARITHMIC * positive.min():
                ax.set_xscale("log")
        if second:
            left.legend(loc="best")
        else:
            stable = np.asarray(rows["largest_multiplier"] < 1.0)
            left.fill_between(
                rows[first].to_numpy(float), 0.0, 1.0, where=stable, color=BLUE, alpha=0.15, linewidth=0.0
            )
    return figure, table.reset_index(drop=True)
