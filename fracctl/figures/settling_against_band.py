"""The best settling of each law against the band that it settles to, under every limit."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from fracctl.figures.compared_laws import compared, law_name, laws, legend, look, note, panel_title
from fracctl.figures.results import FigureError, Results, Selection, objective_scale
from fracctl.figures.style import FULL_WIDTH_IN

_PANEL_HEIGHT_IN = 1.32
_TICKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw the objective against the band on logarithmic axes, a curve for each law.

    There is a row of panels for each initial condition and kind of limit, with a column for each of its values.

    Raises:
        FigureError: the run is no comparison, or no law has a result.
    """
    table = compared(results, selection)
    table = table[table["law"].isin(laws(results)) & np.isfinite(table["objective"].astype(float))]
    if table.empty:
        raise FigureError("no law has a result")
    scale, title = objective_scale(results, selection)
    kinds = [kind for kind in ("gain", "peak") if (table["limit"] == kind).any()]
    values = {kind: sorted(table.loc[table["limit"] == kind, "limit_value"].unique()) for kind in kinds}
    rows = [(name, kind) for name in selection.initial_conditions for kind in kinds]
    columns = max(map(len, values.values()))
    figure = Figure(figsize=(FULL_WIDTH_IN, 0.8 + _PANEL_HEIGHT_IN * len(rows)), layout="constrained")
    axes = figure.subplots(len(rows), columns, squeeze=False, sharex=True, sharey=True)
    for (name, kind), line in zip(rows, axes, strict=True):
        for ax, value in zip(line, [*values[kind], *[math.nan] * (columns - len(values[kind]))], strict=True):
            if math.isnan(value):
                ax.set_axis_off()
                continue
            own = table[(table["initial_condition"] == name) & (table["limit"] == kind)]
            own = own[own["limit_value"] == value].sort_values("threshold_m")
            for place, law in reversed(list(enumerate(laws(results)))):
                of_law, size = own[own["law"] == law], 2.4 + 1.1 * place
                ax.loglog(of_law["threshold_m"], of_law["objective"] / scale, markersize=size, **look(results, law))
            note(ax, panel_title({"initial_condition": name, "limit": kind, "limit_value": value}))
    first = axes[0, 0]
    first.set_xlim(1.5 * table["threshold_m"].max(), table["threshold_m"].min() / 1.5)
    first.xaxis.set_major_locator(FixedLocator(sorted(table["threshold_m"].unique())))
    first.yaxis.set_major_locator(FixedLocator(_TICKS))
    for axis in (first.xaxis, first.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(NullLocator())
    for ax in axes[-1]:
        ax.set_xlabel(r"Settling band $\delta$ (m)")
    figure.supylabel(title, fontsize=9.0)
    legend(figure, results)
    names = table["law"].map(law_name)
    return figure, table.assign(law_name=names)[
        ["initial_condition", "limit", "limit_value", "threshold_m", "law", "law_name", "objective"]
    ]
