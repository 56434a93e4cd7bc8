"""Free and controlled motion in a plane: positions with equal axes, or an angle and its rate."""

from __future__ import annotations

import math
from itertools import zip_longest
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of, table_of
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, GREY, ORANGE
from fracctl.plants import RotatingEllipsoid

_COLUMNS = 3
"""Of panels of free motion alone."""
_HEIGHT_OVER_WIDTH = 0.75
"""Of a panel."""
_TITLES = {"baseline": "free", "overall": "controlled"}


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw a row for each initial condition: free motion left, controlled motion right; or free motion alone in threes.

    Free motion is grey, controlled motion blue, its last delay orange; a dot marks the beginning.
    Angles are wrapped. A body is drawn where the plant has one.

    Raises:
        FigureError: the run holds no trajectory of an optimum.
    """
    curves = {name: curves_of(results, selection, name) for name in selection.initial_conditions}
    panels = {(name, curve.kind): curve for name, found in curves.items() for curve in found}
    kinds = [kind for kind in _TITLES if any(kind == of for _, of in panels)]
    places = [(name, kind) for name in curves for kind in kinds]
    columns = 2 if len(kinds) > 1 else min(_COLUMNS, len(places))
    rows = math.ceil(len(places) / columns)
    size = (FULL_WIDTH_IN, _HEIGHT_OVER_WIDTH * FULL_WIDTH_IN / max(columns, 2) * rows)
    figure = Figure(figsize=size, layout="constrained")
    for ax, place in zip_longest(figure.subplots(rows, columns, squeeze=False).flat, places):
        if place not in panels:
            ax.set_axis_off()
            continue
        name, kind = place
        _draw(ax, panels[place], results)
        ax.set_title(f"{labels.initial_condition(name)}, {_TITLES[kind]}{_ending(panels[place])}")
    return figure, table_of(curves)


def _draw(ax: Axes, curve: Curve, results: Results) -> None:
    position, other = (*curve.components, f"{curve.components[0]}_dot")[:2]
    plane = not other.endswith("_dot")
    unit, suffix = _unit(results) if plane else (1.0, "")
    x, y = (curve.samples[name].to_numpy(float) * unit for name in (position, other))
    style: dict[str, Any] = {"linewidth": 0.6}
    if position in results.plant.angles:
        x = (x + math.pi) % math.tau - math.pi
        style = {"linestyle": "none", "marker": ".", "markersize": 1.0, "markeredgewidth": 0.0}
    times, delay = curve.times, float(curve.best["delay"])
    begin = delay * float(curve.best["switch_on_delays"]) if curve.best["gain_factor"] != 0.0 else math.inf
    free, late = times <= begin, times >= times[-1] - delay
    ax.plot(np.where(free, x, np.nan), np.where(free, y, np.nan), color=GREY, **style)
    controlled = np.append(~free[1:], not free[-1])
    ax.plot(np.where(controlled, x, np.nan), np.where(controlled, y, np.nan), color=BLUE, **style)
    if math.isfinite(begin):
        ax.plot(x[late], y[late], color=ORANGE, **style | ({} if "marker" in style else {"linewidth": 1.4}))
    ax.plot(x[:1], y[:1], "o", color="black", markersize=3.0)
    ax.set_xlabel(f"${labels.symbol(position)}${suffix}")
    ax.set_ylabel(f"${labels.symbol(other)}${suffix}")
    if plane:
        ax.set_aspect("equal", adjustable="datalim")
        if isinstance(results.plant, RotatingEllipsoid):
            a, b = results.plant.semi_axes
            ax.add_patch(Ellipse((0.0, 0.0), 2.0 * a * unit, 2.0 * b * unit, facecolor="#DDDDDD", edgecolor=GREY))


def _unit(results: Results) -> tuple[float, str]:
    """Kilometres in a unit of length, and the words behind a symbol."""
    return (1.0, "") if results.scales is None else (1e-3 * results.scales.length_m, " (km)")


def _ending(curve: Curve) -> str:
    status = str(curve.best["status"])
    return "" if status == "ok" else f" ({status.replace('_', ' ')})"
