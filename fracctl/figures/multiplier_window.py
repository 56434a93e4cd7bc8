"""The largest multiplier against what a survey varies, and the window in which it is below 1."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import BLUE, CYCLE, FULL_WIDTH_IN, GREY
from fracctl.stability.windows import windows

_HEIGHT_IN = 2.6
_LOGARITHMIC = 50.0
"""Values over more than this factor have a logarithmic axis."""
_BAR = 0.03
"""Height of a bar, of the axes'."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw multipliers left and the periodicity error at the end right, a line for each value of a second axis.

    Shaded is where the multiplier is below 1, read off the straight lines between the points.

    Raises:
        FigureError: the survey does not vary one or two variables, or multipliers were not measured.
    """
    if len(results.varied) not in (1, 2) or "largest_multiplier" not in results.columns:
        raise FigureError("the survey must vary one or two variables, and measure largest_multiplier")
    first, *second = results.varied
    figure = Figure(figsize=(FULL_WIDTH_IN, _HEIGHT_IN * len(selection.initial_conditions)), layout="constrained")
    axes = figure.subplots(len(selection.initial_conditions), 2, squeeze=False, sharex=True)
    columns = ["initial_condition", *results.varied, "largest_multiplier", "periodicity_error", "status"]
    table = results.run.evaluations(columns)
    for name, (left, right) in zip(selection.initial_conditions, axes, strict=True):
        rows = table[table["initial_condition"] == name]
        groups = list(rows.groupby(second[0])) if second else [(None, rows)]
        for colour, (value, group) in zip(CYCLE, groups, strict=False):
            label = f"${labels.symbol(second[0])} = {float(str(value)):g}$" if second else None
            x = group[first].to_numpy(float)
            left.plot(x, group["largest_multiplier"], ".-", color=colour, label=label)
            error = group["periodicity_error"].where(group["status"] == "ok").to_numpy(float)
            right.semilogy(x, np.maximum(error, 1e-16), ".-", color=colour, label=label)
        left.axhline(1.0, color=GREY, linewidth=0.8, linestyle=":")
        left.set_ylabel(f"{labels.initial_condition(name)}: largest multiplier")
        right.set_ylabel("periodicity error at the end")
        left.set_ylim(bottom=0.0)
        for ax in (left, right):
            ax.set_xlabel(f"${labels.symbol(first)}$")
            if x.min() > 0.0 and x.max() > _LOGARITHMIC * x.min():
                ax.set_xscale("log")
        if second:
            _bars(left, first, [group for _, group in groups])
            left.legend(loc="best", title="bars: multiplier below 1", title_fontsize=8)
        else:
            for ax, (start, end) in itertools.product((left, right), _windows(rows, first)):
                ax.axvspan(start, end, color=BLUE, alpha=0.15, linewidth=0.0, zorder=0)
    return figure, table.reset_index(drop=True)


def _bars(ax: Axes, first: str, groups: Sequence[pd.DataFrame]) -> None:
    """Draw a bar of each line's colour at the bottom where its multiplier is below 1."""
    for place, (colour, group) in enumerate(zip(CYCLE, groups, strict=False)):
        for start, end in _windows(group, first):
            ax.axvspan(start, end, _BAR * place, _BAR * (place + 0.8), color=colour, alpha=0.6, linewidth=0.0, zorder=0)


def _windows(rows: pd.DataFrame, first: str) -> list[tuple[float, float]]:
    return windows(rows[first].to_numpy(float), 1.0 - rows["largest_multiplier"].to_numpy(float))
