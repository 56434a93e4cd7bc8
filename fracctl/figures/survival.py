"""What survives of laws on their way to a flight."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fracctl.figures import labels
from fracctl.figures.compared_laws import law_name
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import CYCLE, FULL_WIDTH_IN, GREY

_PANEL_HEIGHT_IN = 2.2
_MARKERS = ("o", "s", "D", "^", "v", "P", "X", "*")
_SPREAD = 0.6
"""Share of the distance between stages over which laws lie side by side."""
_NEVER = 1.12
"""Height of the line on which flights lie that never settle, over the longest time."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw settling time stage by stage, a row of panels for each start: settling on the left, ΔV on the right.

    A marker is the median of a law's flights, a bar reaches to what 95 % of them keep; hollow markers on the upper line
    never settle.

    Raises:
        FigureError: the run has no flights.
    """
    if results.configuration["evaluation"]["type"] != "flight":
        raise FigureError("the run has no flights; take evaluation=flight")
    rows = results.run.table("survival")
    rows = rows[rows["initial_condition"].isin(selection.initial_conditions)]
    if "law" not in rows:
        rows = rows.assign(law="the law")
    laws, stages = list(dict.fromkeys(rows["law"])), list(dict.fromkeys(rows["stage"]))
    starts = list(dict.fromkeys(rows["initial_condition"]))
    spent = "median_delta_v_m_s" in rows
    size = (FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(starts) + 0.5)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(len(starts), 1 + spent, squeeze=False, sharex=True, width_ratios=[3, 2][: 1 + spent])
    for line, start in zip(axes, starts, strict=True):
        own = rows[rows["initial_condition"] == start]
        _settling(line[0], own, laws, stages)
        title = f"{labels.initial_condition(start)}, to {own['band_m'].iloc[0]:g} m"
        line[0].set_title(title, loc="left", fontsize=8.5)
        line[0].set_ylabel("Settling time (orbits)")
        if spent:
            _bars(line[1], own, laws, stages, ("median_delta_v_m_s", "quantile_95_delta_v_m_s"))
            line[1].set_ylabel("ΔV (m/s)")
            line[1].set_ylim(bottom=0.0)
    for ax in axes[-1]:
        ax.set_xticks(range(len(stages)), stages, rotation=20, ha="right")
    marks = [Line2D([], [], linestyle="none", label=law_name(law), **_look(place)) for place, law in enumerate(laws)]
    figure.legend(handles=marks, loc="outside lower center", ncols=4)
    return figure, rows.reset_index(drop=True)


def _settling(ax: Axes, own: pd.DataFrame, laws: list[str], stages: list[str]) -> None:
    columns = ("median_orbits", "quantile_95_orbits")
    table = own[list(columns)].to_numpy(float)
    longest = float(table[np.isfinite(table)].max(initial=0.0)) or 1.0
    top = _NEVER * longest
    if np.isinf(table).any():
        ax.axhline(top, color=GREY, linewidth=0.5, linestyle=":")
        ax.annotate("never", (0.0, top), xycoords=("axes fraction", "data"), xytext=(3, 2), textcoords="offset points")
    _bars(ax, own, laws, stages, columns, top)
    ax.set_ylim(0.0, top * _NEVER)


def _bars(
    ax: Axes, own: pd.DataFrame, laws: list[str], stages: list[str], columns: tuple[str, str], never: float = np.nan
) -> None:
    """Draw markers at the first column's values with bars up to the second's; what is infinite lies at `never`."""
    step = _SPREAD / max(len(laws) - 1, 1)
    for place, law in enumerate(laws):
        of_law = own[own["law"] == law].set_index("stage").reindex(stages)
        x = np.arange(len(stages)) - 0.5 * _SPREAD + step * place
        middle, most = (of_law[column].to_numpy(float) for column in columns)
        gone = np.isinf(middle)
        reach = np.where(np.isinf(most), never, most)
        ax.vlines(x[~gone], middle[~gone], reach[~gone], color=_look(place)["color"], linewidth=0.9)
        ax.plot(x[~gone], middle[~gone], linestyle="none", **_look(place))
        ax.plot(x[gone], np.full(gone.sum(), never), linestyle="none", **_look(place) | {"markerfacecolor": "none"})
    for edge in np.arange(len(stages) - 1) + 0.5:
        ax.axvline(edge, color="0.9", linewidth=0.4)


def _look(place: int) -> dict[str, Any]:
    return {"color": CYCLE[place % len(CYCLE)], "marker": _MARKERS[place % len(_MARKERS)], "markersize": 3.5}
