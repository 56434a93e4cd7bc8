"""The objective over two gains, at the baseline's order and at the best one (Figure 2 of the paper)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Row, Selection, objective_scale, optimum
from fracctl.figures.style import COLOUR_MAP, FULL_WIDTH_IN, STAR

_PANEL_HEIGHT_IN = 2.7
_RANGE = 20.0
"""Contours reach from the smallest value of a row of panels to this many times it; what lies above is one colour."""
_ROUND = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0)
"""Levels of a decade."""
_OPTIMUM: dict[str, Any] = {**STAR, "color": "#19C37D"}
_UNSETTLED: dict[str, Any] = {"facecolor": "0.93", "edgecolor": "0.45", "hatch": "////", "linewidth": 0.0}


@dataclass(frozen=True)
class _Panel:
    rows: pd.DataFrame
    """Evaluations of one initial condition on one slice."""
    best: Row
    """The optimum of the slice."""
    title: str


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw filled contours with a star at each optimum, one row of panels an initial condition.

    Points that do not settle are hatched. The panels of a row share their colour bar.

    Raises:
        FigureError: the run is not a grid over two gains, or has no optimum.
    """
    if len(results.varied) != 2:
        found = " and ".join(results.varied) or "none"
        raise FigureError(f"contours need a grid that varies two gains; this run varies {found}")
    x, y = results.varied
    rows = [_panels(results, selection, name) for name in selection.initial_conditions]
    columns = max(map(len, rows))
    width = FULL_WIDTH_IN if columns > 1 else 0.6 * FULL_WIDTH_IN
    figure = Figure(figsize=(width, _PANEL_HEIGHT_IN * len(rows) + 0.35), layout="constrained")
    axes = figure.subplots(len(rows), columns, squeeze=False, sharex=True, sharey=True)
    scale, title = objective_scale(results, selection)
    for panels, line in zip(rows, axes, strict=True):
        contours = _row(panels, line, selection.value_column, scale, (x, y))
        bar = figure.colorbar(contours, ax=list(line), pad=0.02, aspect=24, ticks=contours.levels, spacing="uniform")
        bar.set_label(title)
        line[0].set_ylabel(f"Gain ${labels.symbol(y)}$")
    for ax in axes[-1]:
        ax.set_xlabel(f"Gain ${labels.symbol(x)}$")
    figure.legend(handles=_handles(results, selection, rows), loc="outside lower center", ncols=2)
    return figure, _table(rows, selection, (x, y), results.slice_variable)


def _panels(results: Results, selection: Selection, initial_condition: str) -> list[_Panel]:
    cut, title = results.slice_variable, labels.initial_condition(initial_condition)
    columns = ["initial_condition", *([cut] if cut else []), *results.varied, selection.value_column, "status"]
    panels: list[_Panel] = []
    for kind in ("baseline", "overall"):
        best = optimum(results, selection, initial_condition, kind)
        if best is None or any(cut is None or best[cut] == panel.best[cut] for panel in panels):
            continue
        wanted = {"initial_condition": [initial_condition]} | ({cut: [best[cut]]} if cut else {})
        rows = results.run.evaluations_where(wanted, columns)
        panels.append(_Panel(rows, best, title + (f", ${labels.symbol(cut)} = {best[cut]:g}$" if cut else "")))
    if not panels:
        raise FigureError(f"'{initial_condition}' has no optimum of {selection.objective}")
    return panels


def _row(panels: list[_Panel], line: Any, column: str, scale: float, names: tuple[str, str]) -> QuadContourSet:
    fields = [_field(panel.rows, column, scale, names) for panel in panels]
    finite = np.concatenate([values[np.isfinite(values)] for _, _, values in fields])
    levels = _levels(finite)
    extend: Literal["max", "neither"] = "max" if finite.max() > levels[-1] else "neither"
    for ax, panel, field in zip(line, panels, fields, strict=False):
        contours = _contours(ax, field, levels, extend)
        place = (float(panel.best[names[0]]), float(panel.best[names[1]]))
        ax.plot(*place, markersize=13.0, clip_on=False, zorder=5, **_OPTIMUM)
        at = f"{panel.best[column] / scale:#.4g} at ({place[0]:g}, {place[1]:g})"
        ax.set_title(f"{panel.title}: {at}")
    for ax in line[len(panels) :]:
        ax.text(0.5, 0.5, "No other order does better.", ha="center", transform=ax.transAxes)
    return contours


def _field(rows: pd.DataFrame, column: str, scale: float, names: tuple[str, str]) -> tuple[Floats, Floats, Floats]:
    table = rows.pivot(index=names[1], columns=names[0], values=column)
    values = table.to_numpy(dtype=float) / scale
    return table.columns.to_numpy(float), table.index.to_numpy(float), np.where(np.isfinite(values), values, np.nan)


def _levels(values: Floats) -> Floats:
    """Round numbers, denser near the optimum; even steps where values are close to each other or not positive."""
    smallest, largest = float(values.min()), float(values.max())
    if smallest <= 0.0 or largest < 2.0 * smallest:
        return np.asarray(MaxNLocator(nbins=12).tick_values(smallest, largest), dtype=float)
    largest = min(largest, _RANGE * smallest)
    decades = np.arange(math.floor(math.log10(smallest)), math.ceil(math.log10(largest)) + 1.0)
    numbers = np.unique(np.outer(10.0**decades, _ROUND).round(12))
    first, last = np.searchsorted(numbers, smallest, "right") - 1, np.searchsorted(numbers, largest)
    return numbers[first : last + 1]


def _contours(
    ax: Axes, field: tuple[Floats, Floats, Floats], levels: Floats, extend: Literal["max", "neither"]
) -> QuadContourSet:
    x, y, values = field
    corner, width, height = (x[0], y[0]), x[-1] - x[0], y[-1] - y[0]
    ax.add_patch(Rectangle(corner, width, height, **_UNSETTLED))
    masked = np.ma.masked_invalid(values)
    contours = ax.contourf(x, y, masked, levels=levels, cmap=COLOUR_MAP, norm=BoundaryNorm(levels, 256), extend=extend)
    ax.contour(x, y, masked, levels=levels, colors="white", linewidths=0.25, alpha=0.6)
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(y[0], y[-1])
    return contours


def _handles(results: Results, selection: Selection, rows: list[list[_Panel]]) -> list[Artist]:
    handles: list[Artist] = [Line2D([], [], markersize=11.0, label="optimum", **_OPTIMUM)]
    shown = pd.concat([panel.rows[selection.value_column] for panels in rows for panel in panels])
    if not np.isfinite(shown).all():
        label = f"not settled within {results.horizon_periods:g} {results.period_name}"
        handles.append(Patch(label=label, **_UNSETTLED))
    return handles


def _table(rows: list[list[_Panel]], selection: Selection, names: tuple[str, str], cut: str | None) -> pd.DataFrame:
    columns = ["initial_condition", *([cut] if cut else []), *names, selection.value_column, "status"]
    parts = []
    for panel in (panel for panels in rows for panel in panels):
        part = panel.rows[columns].sort_values(list(names))
        at_optimum = (part[names[0]] == panel.best[names[0]]) & (part[names[1]] == panel.best[names[1]])
        parts.append(part.assign(optimum=at_optimum))
    return pd.concat(parts, ignore_index=True)
