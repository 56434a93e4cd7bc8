"""The loop gain in the complex plane, with the point -1 that it must keep away from."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fracctl.arrays import Complexes
from fracctl.figures import labels
from fracctl.figures.loop_gain import COLOURS, LoopGain, loop_gains, table_of
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import FULL_WIDTH_IN, GREY

_WIDEST_PANEL_IN = 3.9
_LEFT, _RIGHT, _UP = -3.0, 2.0, 2.5
_AWAY = 0.7
"""Fewer radians between neighbouring points than this are no leap through infinity."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw L(iω) for ω > 0 (solid) and ω < 0 (thin), for each initial condition; optimum and baseline.

    With one control, the dotted circle about -1 is the one that each curve just touches, of radius 1/M_s, and a dot
    marks the phase margin on the unit circle. With several, the curve is det(I + L) - 1.

    Raises:
        FigureError: the run holds no frequency responses.
    """
    gains = {name: loop_gains(results, selection, name) for name in selection.initial_conditions}
    one = len(results.components) == 1
    side = min(_WIDEST_PANEL_IN, FULL_WIDTH_IN / len(gains))
    figure = Figure(figsize=(side * len(gains), side + 0.6), layout="constrained")
    axes = figure.subplots(1, len(gains), squeeze=False, sharey=True)[0]
    for ax, (name, several) in zip(axes, gains.items(), strict=True):
        _plane(ax)
        for gain in several:
            _curve(ax, gain, one)
        ax.set_title(labels.initial_condition(name), loc="left")
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.38 / side), fontsize=7.0)
    what = "L" if one else r"(\det(I + L) - 1)"
    axes[0].set_ylabel(rf"$\mathrm{{Im}}\,{what}$")
    for ax in axes:
        ax.set_xlabel(rf"$\mathrm{{Re}}\,{what}$")
    return figure, table_of(gains)


def _plane(ax: Axes) -> None:
    ax.add_patch(Circle((0.0, 0.0), 1.0, fill=False, edgecolor=GREY, linewidth=0.5, linestyle=(0, (4, 3)), zorder=0))
    ax.axhline(0.0, color=GREY, linewidth=0.5, zorder=0)
    ax.axvline(0.0, color=GREY, linewidth=0.5, zorder=0)
    ax.plot(-1.0, 0.0, marker="+", color="black", markersize=8.0, markeredgewidth=1.2, zorder=4)
    ax.set_aspect("equal")
    ax.set_xlim(_LEFT, _RIGHT)
    ax.set_ylim(-_UP, _UP)


def _curve(ax: Axes, gain: LoopGain, one: bool) -> None:
    colour, values = COLOURS[gain.kind], _without_leaps(gain.values)
    ax.plot(values.real, values.imag, color=colour, label=gain.label, zorder=3)
    ax.plot(values.real, -values.imag, color=colour, linewidth=0.5, zorder=2)
    if not one:
        return
    radius = 1.0 / max(1.0, float(gain.sensitivity.max()))
    ax.add_patch(Circle((-1.0, 0.0), radius, fill=False, edgecolor=colour, linewidth=0.8, linestyle=":", zorder=1))
    if (found := gain.phase_margin) is not None:
        point = np.exp(1j * np.radians(found[1]))
        ax.plot(point.real, point.imag, marker="o", color=colour, markersize=3.5, zorder=4)


def _without_leaps(values: Complexes) -> Complexes:
    """Return the curve with a gap where it passes through infinity."""
    turned = np.abs(np.angle(values[1:] / values[:-1])) > _AWAY
    far = np.minimum(np.abs(values[1:]), np.abs(values[:-1])) > abs(_LEFT)
    (places,) = np.nonzero(turned & far)
    return np.insert(values, places + 1, np.nan)
