"""What a survey of a deployment law trades: settling against overshoot, with the margin of the tension."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import COLOUR_MAP, FULL_WIDTH_IN, ORANGE, STAR

_PANEL_HEIGHT_IN = 2.8
SETTLING, OVERSHOOT, MARGIN = "settling_2_percent_orbits", "overshoot_percent", "tension_margin"


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw every point by settling and overshoot, coloured by the tension margin, and settling over the two axes.

    Points that no other one beats in both are joined. Negative margins, of demands beyond a bound, share a colour
    where there are positive ones.

    Raises:
        FigureError: a measure is missing, the survey does not vary two parameters, or no point has settled.
    """
    rows = results.evaluations
    if missing := [name for name in (SETTLING, OVERSHOOT, MARGIN) if name not in rows]:
        raise FigureError(f"the run does not measure {', '.join(missing)}")
    axes_names = [name for name in results.configuration["survey"].get("axes", {}) if rows[name].nunique() > 1]
    if len(axes_names) != 2:
        raise FigureError(f"the survey varies {len(axes_names)} parameters; two are drawn")
    names = selection.initial_conditions
    figure = Figure(figsize=(FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(names)), layout="constrained")
    for name, (left, right) in zip(names, figure.subplots(len(names), 2, squeeze=False), strict=True):
        own = rows[(rows["initial_condition"] == name) & np.isfinite(rows[SETTLING])]
        if own.empty:
            raise FigureError(f"no point settles from '{name}'")
        _traded(figure, left, own)
        _over_axes(figure, right, own, axes_names)
    columns = ["initial_condition", *axes_names, SETTLING, OVERSHOOT, MARGIN]
    return figure, rows.loc[rows["initial_condition"].isin(names), columns].reset_index(drop=True)


def _traded(figure: Figure, ax: Axes, rows: pd.DataFrame) -> None:
    least = 0.0 if rows[MARGIN].min() < 0.0 < rows[MARGIN].max() else None
    shade: dict[str, Any] = {"c": rows[MARGIN], "cmap": COLOUR_MAP, "vmin": least}
    points = ax.scatter(rows[SETTLING], rows[OVERSHOOT], s=14.0, linewidths=0.0, **shade)
    front = front_of(rows)
    ax.plot(front[SETTLING], front[OVERSHOOT], color=ORANGE, linewidth=0.9, marker="o", markersize=2.5)
    ax.set_xlabel("Settling to 2 % (orbits)")
    ax.set_ylabel("Overshoot (%)")
    extend = "neither" if least is None else "min"
    figure.colorbar(points, ax=ax, extend=extend, label="Margin of the demanded tension")


def front_of(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that no other one beats in settling and overshoot, by settling."""
    ordered = rows.sort_values([SETTLING, OVERSHOOT])
    lowest = ordered[OVERSHOOT].cummin().shift(fill_value=np.inf)
    front: pd.DataFrame = ordered[ordered[OVERSHOOT] < lowest]
    return front


def _over_axes(figure: Figure, ax: Axes, rows: pd.DataFrame, names: list[str]) -> None:
    across, up = names
    grid = rows.pivot_table(index=up, columns=across, values=SETTLING)
    mesh = ax.pcolormesh(grid.columns, grid.index, grid.to_numpy(), cmap=COLOUR_MAP, shading="nearest", rasterized=True)
    best = rows.sort_values(SETTLING).iloc[:1]
    ax.plot(best[across], best[up], color=ORANGE, markersize=9.0, **STAR)
    ax.set_xlabel(f"${labels.symbol(across)}$")
    ax.set_ylabel(f"${labels.symbol(up)}$")
    figure.colorbar(mesh, ax=ax, label="Settling to 2 % (orbits)")
