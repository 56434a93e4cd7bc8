"""How far a controlled motion is from repeating itself, and what control it takes."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of, table_of
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import BLUE, CYCLE, FULL_WIDTH_IN, GREY

_PANEL_HEIGHT_IN = 1.9


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw a row for each initial condition: |x(t) - x(t - τ)| left, on a logarithmic axis, the control right.

    Raises:
        FigureError: the run holds no trajectory of an optimum.
    """
    curves = {name: curves_of(results, selection, name)[-1:] for name in selection.initial_conditions}
    figure = Figure(figsize=(FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(curves) + 0.4), layout="constrained")
    axes = figure.subplots(len(curves), 2, squeeze=False)
    for (name, (curve,)), (left, right) in zip(curves.items(), axes, strict=True):
        periods = curve.times / math.tau
        error = curve.samples["periodicity_error"].to_numpy(float)
        left.semilogy(periods, np.maximum(error, 1e-16), color=BLUE, linewidth=0.8)
        left.set_ylabel(f"{labels.initial_condition(name)}:\n$|x(t) - x(t-\\tau)|$")
        _control(right, curve, periods, results)
    for ax in axes[-1]:
        ax.set_xlabel(f"Time ({results.period_name})")
    return figure, table_of(curves)


def _control(ax: Axes, curve: Curve, periods: Floats, results: Results) -> None:
    values = {name: curve.samples[f"control_{name}"].to_numpy(float) for name in curve.components}
    scale = 1.0 if results.scales is None else results.scales.acceleration_m_s2
    peak = scale * max(float(np.nanmax(np.abs(column))) for column in values.values())
    size, unit = (1.0, "") if results.scales is None else labels.acceleration_unit(peak)
    for colour, (name, column) in zip(CYCLE, values.items(), strict=False):
        ax.plot(
            periods, column * scale / size, color=colour, linewidth=0.8, label=f"${labels.symbol(f'control_{name}')}$"
        )
    ax.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
    ax.set_ylabel("Control" + (f" ({unit})" if unit else ""))
    if len(values) > 1:
        ax.legend(loc="best")
