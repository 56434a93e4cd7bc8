"""How far a follower has drifted at the end of every orbit of its leader, without control and with it."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.curves import Curve, curves_of
from fracctl.figures.results import Results, Selection
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, GREY

_PANEL_HEIGHT_IN = 2.2
_COLOURS = {"baseline": GREY, "overall": BLUE}


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw a row for each initial condition: change of position since the first orbit left, from orbit to orbit right.

    Raises:
        FigureError: the run holds no trajectory of an optimum.
    """
    figure = Figure(
        figsize=(FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(selection.initial_conditions) + 0.3), layout="constrained"
    )
    axes = figure.subplots(len(selection.initial_conditions), 2, squeeze=False)
    unit = 1.0 if results.scales is None else 1e-3 * results.scales.length_m
    suffix = "" if results.scales is None else " (km)"
    parts = []
    for name, (left, right) in zip(selection.initial_conditions, axes, strict=True):
        for curve in curves_of(results, selection, name):
            places = unit * _places(curve, results)
            orbits = np.arange(len(places))
            moved = np.linalg.norm(places - places[0], axis=1)
            step = np.concatenate([[np.nan], np.linalg.norm(np.diff(places, axis=0), axis=1)])
            label, colour = labels.controller(curve.best), _COLOURS[curve.kind]
            left.semilogy(orbits[1:], np.maximum(moved[1:], 1e-16), color=colour, label=label)
            right.semilogy(orbits[1:], np.maximum(step[1:], 1e-16), color=colour, label=label)
            columns = {"orbit": orbits, "moved": moved, "drift": step}
            parts.append(pd.DataFrame({"initial_condition": name, "kind": curve.kind, **columns}))
        left.set_ylabel(f"{labels.initial_condition(name)}:\nmoved since the start{suffix}")
        right.set_ylabel(f"drift in an orbit{suffix}")
        left.legend(loc="best")
    for ax in axes[-1]:
        ax.set_xlabel("Orbit")
    return figure, pd.concat(parts, ignore_index=True)


def _places(curve: Curve, results: Results) -> Floats:
    """Positions after 0, 1, 2, … periods 2π, (k, m)."""
    times = math.tau * np.arange(math.floor(results.horizon_periods + 1e-9) + 1)
    times = np.minimum(times, curve.times[-1])
    return np.column_stack([curve.values(name, times) for name in curve.components])
