"""A state, or the tension, of a tether against time under several laws, or one law with several values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.arrays import Floats
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection, chosen
from fracctl.figures.style import CYCLE, FULL_WIDTH_IN, GREY

_PANEL_HEIGHT_IN = 2.3
_CLOSE = 0.05
"""Of the largest distance from the last value: half the height of the close view."""
_BAND = 0.02
TENSION = "tension"
_WORDS = {
    "length": r"Length $\lambda$",
    "length_dot": r"Rate of the length $\lambda'$",
    "theta": r"In-plane angle $\theta$ (rad)",
    "phi": r"Out-of-plane angle $\varphi$ (rad)",
    TENSION: r"Tension $\hat T$",
}


@dataclass(frozen=True)
class _Curve:
    name: str
    periods: Floats
    values: Floats


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw a row for each initial condition: the whole run left, the approach to the last value right.

    The option `shows` is a state or ``tension``, with its bounds. A band of 2 % about the target of the length is
    drawn; a curve that ends early ends with a cross.

    Raises:
        FigureError: the run holds no such trajectories.
    """
    shows = selection.shows or "length"
    if shows not in _WORDS:
        raise FigureError(f"shows = {shows}: must be one of {', '.join(_WORDS)}")
    curves = {name: _curves(results, selection, name, shows) for name in selection.initial_conditions}
    size = (FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(curves) + 0.3)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(len(curves), 2, squeeze=False, width_ratios=(1.25, 1.0))
    for (name, found), (whole, close) in zip(curves.items(), axes, strict=True):
        for ax in (whole, close):
            _draw(ax, found, shows, results)
        words = f"{labels.initial_condition(name)}:\n" if len(curves) > 1 else ""
        whole.set_ylabel(f"{words}{_WORDS[shows]}")
        _approach(close, found, shows)
    for ax in axes[-1]:
        ax.set_xlabel(r"True anomaly $f/2\pi$ (orbits)")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=min(len(names), 4))
    return figure, _table(curves, shows)


def _curves(results: Results, selection: Selection, initial_condition: str, shows: str) -> list[_Curve]:
    rows = chosen(results.optima, selection, initial_condition, "slice")
    if rows.empty:
        rows = chosen(results.optima, selection, initial_condition, "overall")
    found = []
    for run, row in zip(rows.index, rows.to_dict("records"), strict=True):
        samples = results.trajectories[results.trajectories["run"] == run].sort_values("time")
        if not samples.empty:
            periods = samples["time"].to_numpy(float) / math.tau
            found.append(_Curve(_name(results, row), periods, _values(results, samples, shows)))
    if not found:
        raise FigureError(f"no trajectory is stored for '{initial_condition}'")
    return found


def _name(results: Results, row: Mapping[Any, Any]) -> str:
    if "law" in row:
        return str(row["law"])
    if (variable := results.slice_variable) is not None:
        return f"${labels.symbol(variable)} = {row[variable]:g}$"
    return labels.initial_condition(str(row["initial_condition"]))


def _values(results: Results, samples: pd.DataFrame, shows: str) -> Floats:
    if shows == TENSION:
        tension: Floats = results.plant.rho - samples["control_length"].to_numpy(float)
        return tension
    return samples[shows].to_numpy(float)


def _draw(ax: Axes, curves: list[_Curve], shows: str, results: Results) -> None:
    for colour, curve in zip(CYCLE, curves, strict=False):
        ax.plot(curve.periods, curve.values, color=colour, linewidth=1.0, label=curve.name)
        known = np.flatnonzero(np.isfinite(curve.values))
        if known.size and known[-1] < len(curve.values) - 1:
            ax.plot(curve.periods[known[-1]], curve.values[known[-1]], marker="x", color=colour)
    if shows == TENSION:
        half = float(results.plant.limits[0, 0])
        for bound in (results.plant.rho - half, results.plant.rho + half):
            ax.axhline(bound, color=GREY, linewidth=0.6, linestyle="--", zorder=0)
    ax.set_xlim(0.0, float(curves[0].periods[-1]))


def _approach(ax: Axes, curves: list[_Curve], shows: str) -> None:
    """Look at the last value closely; of the tension, at the first fifth of the time."""
    if shows == TENSION:
        ax.set_xlim(0.0, 0.2 * float(curves[0].periods[-1]))
        return
    last = next((curve.values[-1] for curve in curves if np.isfinite(curve.values[-1])), 0.0)
    target = round(float(last), 1)
    span = max(float(np.nanmax(np.abs(curve.values[0] - target))) for curve in curves)
    reach = _CLOSE * (span or 1.0)
    ax.set_ylim(target - reach, target + reach)
    if shows == "length":
        ax.axhspan(target - _BAND * span, target + _BAND * span, color=GREY, alpha=0.12, linewidth=0.0)
    ax.axhline(target, color=GREY, linewidth=0.5, zorder=0)


def _table(curves: dict[str, list[_Curve]], shows: str) -> pd.DataFrame:
    parts = [
        pd.DataFrame({"initial_condition": name, "curve": curve.name, "orbits": curve.periods, shows: curve.values})
        for name, found in curves.items()
        for curve in found
    ]
    return pd.concat(parts, ignore_index=True)
