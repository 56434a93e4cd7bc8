"""Free and controlled motion in a plane: positions with equal axes, or an angle and its rate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse

from fracctl.arrays import Array
from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of, table_of
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, GREY, ORANGE
from fracctl.plants import PerturbedRelativeMotion, RelativeMotion, RotatingEllipsoid, TschaunerHempel

_PANEL_HEIGHT_IN = 2.6
_LEGEND_HEIGHT_IN = 0.3
_ABREAST = 3
"""Panels in a row where there is one for each initial condition."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw baseline and optimum side by side for each initial condition, or one panel where they are the same.

    Free motion is grey, controlled motion blue, its last delay orange; a dot marks the beginning. Relative motion is
    drawn with the direction of flight to the right and the radial direction upwards. Angles are wrapped. A body is
    drawn where the plant has one.

    Raises:
        FigureError: the run holds no trajectory of an optimum.
    """
    curves = {name: curves_of(results, selection, name) for name in selection.initial_conditions}
    panels = _panels(curves)
    size = (FULL_WIDTH_IN, _PANEL_HEIGHT_IN * (2.0 / panels.shape[1]) ** 0.5 * len(panels) + _LEGEND_HEIGHT_IN)
    figure = Figure(figsize=size, layout="constrained")
    shown: dict[str, Artist] = {}
    for ax, panel in zip(figure.subplots(*panels.shape, squeeze=False).flat, panels.flat, strict=True):
        if panel is None:
            ax.set_axis_off()
            continue
        name, curve = panel
        shown |= _draw(ax, curve, results)
        ax.set_title(f"{labels.initial_condition(name)}, {labels.controller(curve.best)}{_ending(curve)}")
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=len(shown))
    return figure, table_of(curves)


def _panels(curves: Mapping[str, Sequence[Curve]]) -> Array:
    """Initial condition and curve by row and column, None where there is none."""
    if any(len(found) > 1 for found in curves.values()):
        rows = [{curve.kind: (name, curve) for curve in found} for name, found in curves.items()]
        flat, width = [row.get(kind) for row in rows for kind in ("baseline", "overall")], 2
    else:
        flat = [(name, found[0]) for name, found in curves.items()]
        width = min(_ABREAST, len(flat))
        flat += [None] * (-len(flat) % width)
    panels = np.empty(len(flat), dtype=object)
    panels[:] = flat
    return panels.reshape(-1, width)


def _draw(ax: Axes, curve: Curve, results: Results) -> dict[str, Artist]:
    """Draw a curve and return what a legend shows, by its words."""
    across, up = _axes(results, curve.components)
    unit = 1.0 if across.unit == "" or results.scales is None else 1e-3 * results.scales.length_m
    x, y = (curve.samples[axis.column].to_numpy(float) * unit for axis in (across, up))
    style: dict[str, Any] = {"linewidth": 0.6}
    if across.column in results.plant.angles:
        x = (x + math.pi) % math.tau - math.pi
        style = {"linestyle": "none", "marker": ".", "markersize": 1.0, "markeredgewidth": 0.0}
    times, delay = curve.times, float(curve.best["delay"])
    begin = delay * float(curve.best["switch_on_delays"]) if curve.best["gain_factor"] != 0.0 else math.inf
    free, late = times <= begin, times >= times[-1] - delay
    controlled = np.append(~free[1:], not free[-1])
    shown: dict[str, Artist] = {}
    for where, colour, words in ((free, GREY, "free motion"), (controlled, BLUE, "under control")):
        if where.any():
            ax.plot(np.where(where, x, np.nan), np.where(where, y, np.nan), color=colour, **style)
            shown[words] = Line2D([], [], color=colour)
    if math.isfinite(begin):
        jumps = np.abs(np.diff(x[late], append=x[-1])) > math.pi if "marker" in style else np.zeros(late.sum(), bool)
        (shown["last delay"],) = ax.plot(np.where(jumps, np.nan, x[late]), y[late], color=ORANGE, linewidth=1.4)
    (shown["start"],) = ax.plot(x[:1], y[:1], "o", color="black", markersize=3.0)
    ax.set_xlabel(across.label)
    ax.set_ylabel(up.label)
    if across.unit != "rad":
        ax.set_aspect("equal", adjustable="datalim")
    if isinstance(results.plant, RotatingEllipsoid):
        a, b = (2.0 * unit * axis for axis in results.plant.semi_axes)
        shown["body"] = ax.add_patch(Ellipse((0.0, 0.0), a, b, facecolor="#DDDDDD", edgecolor=GREY))
    return shown


class _Axis(NamedTuple):
    column: str
    unit: str
    words: str = ""

    @property
    def label(self) -> str:
        """Words, symbol and unit."""
        return f"{self.words}${labels.symbol(self.column)}$" + (f" ({self.unit})" if self.unit else "")


def _axes(results: Results, components: Sequence[str]) -> tuple[_Axis, _Axis]:
    """What is drawn to the right and upwards."""
    length = "" if results.scales is None else "km"
    if isinstance(results.plant, RelativeMotion | PerturbedRelativeMotion | TschaunerHempel):
        return _Axis("y", f"{length}, frame rtn", "along-track "), _Axis("x", length, "radial ")
    if len(components) > 1:
        return _Axis(components[0], length), _Axis(components[1], length)
    angle = "rad" if components[0] in results.plant.angles else ""
    return _Axis(components[0], angle), _Axis(f"{components[0]}_dot", "")


def _ending(curve: Curve) -> str:
    status = str(curve.best["status"])
    return "" if status == "ok" else f" ({status.replace('_', ' ')})"
