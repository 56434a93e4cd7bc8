"""Distance from the target on a logarithmic scale, where the algebraic tail of a fractional law is seen."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of
from fracctl.figures.flight import bands, label, line
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import FULL_WIDTH_IN, GREY

_HEIGHT_IN = 3.0
_POINTS = 6001
_ROOM = 10.0
"""The axis ends at a tenth of the smallest band, or of what is left at the end."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw |ξ| against time for each initial condition, with the bands δ that the run measures.

    |ξ| is the distance, over all components; in metres where the plant has units. Dips are passages of the target.

    Raises:
        FigureError: the run holds no trajectory of an optimum.
    """
    curves = {name: curves_of(results, selection, name) for name in selection.initial_conditions}
    figure = Figure(figsize=(FULL_WIDTH_IN, _HEIGHT_IN * len(curves) + 0.2), layout="constrained")
    axes = figure.subplots(len(curves), 1, squeeze=False, sharex=True)[:, 0]
    unit = 1.0 if results.scales is None else results.scales.length_m
    for (name, pair), ax in zip(curves.items(), axes, strict=True):
        _draw(ax, pair, unit)
        _bands(ax, bands(results), unit, results.scales is not None)
        words = "Distance (m)" if results.scales is not None else "Distance"
        ax.set_ylabel(f"{labels.initial_condition(name)}: {words}")
        ax.legend(loc="upper right", frameon=True, framealpha=1.0, edgecolor="none")
        ax.set_xlim(0.0, results.horizon_periods)
    axes[-1].set_xlabel(f"Time ({results.period_name})")
    return figure, _table(curves, unit, results.scales is not None)


def _draw(ax: Axes, curves: Sequence[Curve], unit: float) -> None:
    for curve in curves:
        times = np.linspace(0.0, curve.times[-1], _POINTS)
        ax.semilogy(times / math.tau, unit * distance(curve, times), label=label(curve), **line(curve))


def distance(curve: Curve, times: Floats) -> Floats:
    """Return |ξ| at any times, dimensionless."""
    total: Floats = np.linalg.norm([curve.values(name, times) for name in curve.components], axis=0)
    return total


def _bands(ax: Axes, found: Sequence[float], unit: float, in_metres: bool) -> None:
    lines = [np.asarray(line.get_ydata()) for line in ax.get_lines()]
    lowest = unit * min(found) if found else min(float(line[-_POINTS // 10 :].max()) for line in lines)
    ax.set_ylim(lowest / _ROOM, 2.0 * max(float(line.max()) for line in lines))
    for band in found:
        ax.axhline(unit * band, color=GREY, linewidth=0.6, linestyle=":", zorder=0)
        text = f"{unit * band:g} m" if in_metres else f"{band:g}"
        place = (1.0, unit * band)
        ax.annotate(text, place, (3.0, 0.0), xycoords=("axes fraction", "data"), textcoords="offset points",
                    va="center", fontsize=7, color=GREY)  # fmt: skip


def _table(curves: dict[str, list[Curve]], unit: float, in_metres: bool) -> pd.DataFrame:
    parts = [
        pd.DataFrame(
            {
                "initial_condition": name,
                "kind": curve.kind,
                "periods": curve.times / math.tau,
                "distance_m" if in_metres else "distance": unit * distance(curve, curve.times),
            }
        )
        for name, pair in curves.items()
        for curve in pair
    ]
    return pd.concat(parts, ignore_index=True)
