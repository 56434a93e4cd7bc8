"""The approach as a pilot sees it: V-bar and R-bar with equal axes, and the distance along the orbit normal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of, table_of
from fracctl.figures.flight import bands, label, line, metres
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import FULL_WIDTH_IN, GREY

_ROW_HEIGHT_IN = 3.1
_POINTS = 2000
_TICK_MINUTES = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 240.0, 480.0)
_TICKS = 10
"""At most this many time ticks along a path."""
_SEEN = 0.02
"""Share of the path's reach from which on a hold box is drawn in its place."""
_INSET = 0.32
"""Side of the panel that shows a smaller one, over that of the plane."""
_CORNERS = ((0.03, 0.1), (0.65, 0.1), (0.03, 0.65), (0.65, 0.65))
_LONGER = 1.1
"""A path is drawn so much longer than it takes."""
_RESTS = 1.0 / 50.0
"""Of the largest distance: nearer to the target for good nothing more is seen."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw a row for each initial condition: V-bar to the right, R-bar (nadir) down; H-bar against time at the right.

    V-bar is y, R-bar -x and H-bar -z, against the orbit normal, so that the three form a right-handed frame. Ticks
    along the paths are minutes. The square is the hold box of ±δ of the band by which the run is judged, enlarged in a
    panel of its own where it is small; paths end when the last one has settled to it.

    Raises:
        FigureError: the plant is not three-dimensional in the frame rtn, or has no units.
    """
    names = results.components
    if len(names) != 3 or results.scales is None:
        raise FigureError("an approach is drawn for plants with three components in the frame rtn and units; take hcw")
    curves = {name: curves_of(results, selection, name) for name in selection.initial_conditions}
    figure = Figure(figsize=(FULL_WIDTH_IN, _ROW_HEIGHT_IN * len(curves) + 0.3), layout="constrained")
    axes = figure.subplots(len(curves), 2, squeeze=False, width_ratios=(1.3, 1.0))
    for (name, pair), (plane, across) in zip(curves.items(), axes, strict=True):
        unit, word = metres(results, pair, names)
        band = _judged(results, selection, name)
        end = max(_end(curve, names, band) for curve in pair)
        _plane(plane, results, pair, (unit, word), end, band)
        _across(across, results, pair, (unit, word), end, band)
        plane.set_title(labels.initial_condition(name), loc="left")
    handles, words = axes[0, 1].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=2)
    return figure, table_of(curves)


def _judged(results: Results, selection: Selection, start: str) -> float | None:
    """Return the δ by which flights from a start, or designs, are judged, dimensionless; None if there is no band."""
    assert results.scales is not None
    band_m = results.configuration["evaluation"].get("band_m")
    if band_m is not None:
        return float(band_m[start] if isinstance(band_m, dict) else band_m) / results.scales.length_m
    for band in bands(results):
        if f"settling_time_{band * results.scales.length_m:g}_m" in selection.columns:
            return band
    return results.threshold if results.threshold is not None else next(iter(bands(results)), None)


def _end(curve: Curve, names: Sequence[str], band: float | None) -> float:
    """Return a time somewhat after that from which on the target is near, and the path in its band."""
    sizes = np.abs([curve.samples[name].to_numpy(float) for name in names])
    distance = np.linalg.norm(sizes, axis=0)
    away = distance > _RESTS * distance.max()
    outside = np.zeros_like(away) if band is None else sizes.max(axis=0) > band
    late = np.flatnonzero(away | (outside if not outside[-1] else False))
    return float(min(_LONGER * curve.times[late[-1]], curve.times[-1])) if late.size else float(curve.times[-1])


def _plane(
    ax: Axes, results: Results, curves: Sequence[Curve], unit: tuple[float, str], end: float, band: float | None
) -> None:
    x, y, _ = results.components
    assert results.scales is not None
    minute = 60.0 / results.scales.time_s
    step = next((tick for tick in _TICK_MINUTES if end / (tick * minute) <= _TICKS), _TICK_MINUTES[-1])
    reach = 0.0
    for curve in curves:
        times = np.linspace(0.0, end, _POINTS)
        along, down = curve.values(y, times) / unit[0], -curve.values(x, times) / unit[0]
        reach = max(reach, float(np.hypot(np.ptp(along), np.ptp(down))))
        ax.plot(along, down, **line(curve))
        _ticks(ax, curve, (x, y), step * minute * np.arange(1.0, end / (step * minute)), unit[0])
        ax.plot(along[:1], down[:1], "o", color="black", markersize=3.0)
    ax.plot(0.0, 0.0, marker="+", color="black", markersize=7.0)
    ax.annotate(f"ticks: {step:g} min", (0.98, 0.03), xycoords="axes fraction", ha="right", fontsize=7, color=GREY)
    ax.set_xlabel(rf"V-bar ($+{y}$, along-track) ({unit[1]})")
    ax.set_ylabel(rf"R-bar ($-{x}$, nadir) ({unit[1]})")
    ax.set_aspect("equal", adjustable="datalim")
    ax.invert_yaxis()
    if band is not None:
        half = band / unit[0]
        near = ax if half > _SEEN * reach else _enlarged(ax, curves, (x, y), unit[0], half, end)
        near.add_patch(Rectangle((-half, -half), 2.0 * half, 2.0 * half, fill=False, edgecolor=GREY, linewidth=0.8))
        look: dict[str, Any] = {"ha": "center", "va": "top", "fontsize": 7, "color": GREY}
        text = f"±{band * results.scales.length_m:g} m"
        near.annotate(text, (0.0, half), (0.0, -2.0), textcoords="offset points", **look)


def _enlarged(ax: Axes, curves: Sequence[Curve], names: tuple[str, str], unit: float, half: float, end: float) -> Axes:
    """Return a panel with the surroundings of a small hold box, in the corner that paths leave most room."""
    x, y = names
    times = np.linspace(0.0, end, _POINTS)
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    paths = [(curve.values(y, times) / unit, -curve.values(x, times) / unit) for curve in curves]
    across = np.concatenate([(along - left) / (right - left) for along, _ in paths])
    up = np.concatenate([(down - bottom) / (top - bottom) for _, down in paths])
    corner = min(_CORNERS, key=lambda place: _inside(across - place[0], up - place[1]))
    panel = ax.inset_axes((*corner, _INSET, _INSET), xlim=(-3.0 * half, 3.0 * half), ylim=(3.0 * half, -3.0 * half))
    for curve, (along, down) in zip(curves, paths, strict=True):
        panel.plot(along, down, **line(curve))
    panel.plot(0.0, 0.0, marker="+", color="black", markersize=7.0)
    panel.set_box_aspect(1.0)
    panel.set_xticks([])
    panel.set_yticks([])
    ax.indicate_inset_zoom(panel, edgecolor=GREY)
    return panel


def _inside(across: Floats, up: Floats) -> int:
    return int(((across > 0.0) & (across < _INSET) & (up > 0.0) & (up < _INSET)).sum())


def _ticks(ax: Axes, curve: Curve, names: tuple[str, str], times: Floats, unit: float) -> None:
    """Mark times by short strokes across the path."""
    x, y = names
    shift = 1e-3
    places = np.stack([curve.values(y, times), -curve.values(x, times)]) / unit
    later = np.stack([curve.values(y, times + shift), -curve.values(x, times + shift)]) / unit
    for place, way in zip(places.T, (later - places).T, strict=True):
        angle = math.degrees(math.atan2(-way[1], way[0]))
        ax.plot(*place, marker=(2, 2, angle), color=line(curve)["color"], markersize=7.0, linestyle="none")


def _across(
    ax: Axes, results: Results, curves: Sequence[Curve], unit: tuple[float, str], end: float, band: float | None
) -> None:
    z = results.components[2]
    times = np.linspace(0.0, end, _POINTS)
    for curve in curves:
        words = label(curve)
        ax.plot(times / math.tau, -curve.values(z, times) / unit[0], label=words, **line(curve))
    ax.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
    for level in () if band is None else (-band / unit[0], band / unit[0]):
        ax.axhline(level, color=GREY, linewidth=0.6, linestyle=":", zorder=0)
    ax.set_xlabel(f"Time ({results.period_name})")
    ax.set_ylabel(rf"H-bar ($-{z}$) ({unit[1]})")
    ax.set_xlim(0.0, end / math.tau)
