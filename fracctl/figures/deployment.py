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
from fracctl.errors import suggestion
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection, chosen, showing
from fracctl.figures.style import CYCLE, FULL_WIDTH_IN, GREY

_PANEL_HEIGHT_IN = 2.3
_CLOSE = 0.05
"""Of the span: half the height of the close view."""
_BAND = 0.02
_DASHED_FROM = 3
"""Curves from here on are dashed: variants of a law often lie on it."""
_APART = 0.01
"""Periods between true anomaly and time from which both are shown."""
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
    target: float
    """What the values are led to in the end."""
    times: Floats
    """In orbital periods, t/T."""

    @property
    def span(self) -> float:
        """The way to the target; for a length that is there already, as in the measures, the target."""
        return abs(float(self.values[0]) - self.target) or abs(self.target)


@showing(_WORDS)
def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw a row for each initial condition: the whole run left, the approach to the target right.

    The option `shows` is a state or ``tension``, with its bounds. A band of 2 % about the target of the length is
    drawn; a curve that ends early ends with a cross. Where true anomaly and time differ, time is told on top.

    Raises:
        FigureError: the run holds no such trajectories.
    """
    shows = selection.shows or "length"
    if shows not in _WORDS:
        raise FigureError(f"shows = {shows}: must be one of {', '.join(_WORDS)}{suggestion(shows, _WORDS)}")
    curves = {name: _curves(results, selection, name, shows) for name in selection.initial_conditions}
    size = (FULL_WIDTH_IN, _PANEL_HEIGHT_IN * len(curves) + 0.3)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(len(curves), 2, squeeze=False, width_ratios=(1.25, 1.0))
    for (name, found), (whole, close) in zip(curves.items(), axes, strict=True):
        for ax in (whole, close):
            _draw(ax, found, shows, results)
            if name == selection.initial_conditions[0]:
                _tell_time(ax, found[0])
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
            wanted, time = _target(samples, shows), results.plant.orbits(samples["time"].to_numpy(float))
            found.append(_Curve(_name(results, row), periods, _values(results, samples, shows), wanted, time))
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


def _target(samples: pd.DataFrame, shows: str) -> float:
    column = f"target_{shows}"
    return float(samples[column].iloc[-1]) if column in samples else 0.0


def _draw(ax: Axes, curves: list[_Curve], shows: str, results: Results) -> None:
    for place, curve in enumerate(curves):
        colour, line = CYCLE[place % len(CYCLE)], "-" if place < _DASHED_FROM else "--"
        ax.plot(curve.periods, curve.values, color=colour, linestyle=line, linewidth=1.0, label=curve.name)
        known = np.flatnonzero(np.isfinite(curve.values))
        if known.size and known[-1] < len(curve.values) - 1:
            ax.plot(curve.periods[known[-1]], curve.values[known[-1]], marker="x", color=colour)
    if shows == TENSION:
        half = float(results.plant.limits[0, 0])
        for bound in (results.plant.rho - half, results.plant.rho + half):
            ax.axhline(bound, color=GREY, linewidth=0.6, linestyle="--", zorder=0)
    ax.set_xlim(0.0, float(curves[0].periods[-1]))
    ax.ticklabel_format(axis="y", scilimits=(-4, 4), useMathText=True)


def _tell_time(ax: Axes, curve: _Curve) -> None:
    if np.max(np.abs(curve.times - curve.periods)) < _APART:
        return
    both = (
        lambda orbits: np.interp(orbits, curve.periods, curve.times),
        lambda times: np.interp(times, curve.times, curve.periods),
    )
    ax.secondary_xaxis("top", functions=both).set_xlabel("Time $t/T$ (orbital periods)")


def _approach(ax: Axes, curves: list[_Curve], shows: str) -> None:
    """Look at the targets closely; of the tension, at the first fifth of the time."""
    if shows == TENSION:
        ax.set_xlim(0.0, 0.2 * float(curves[0].periods[-1]))
        return
    reach = max(_CLOSE * curve.span or 1.1 * _late(curve) for curve in curves) or 1.0
    targets = sorted({curve.target for curve in curves})
    ax.set_ylim(targets[0] - reach, targets[-1] + reach)
    for target in targets:
        if shows == "length":
            half = _BAND * max(curve.span for curve in curves if curve.target == target)
            ax.axhspan(target - half, target + half, color=GREY, alpha=0.12, linewidth=0.0)
        ax.axhline(target, color=GREY, linewidth=0.5, zorder=0)


def _late(curve: _Curve) -> float:
    """How far the curve still is from its target in the second half of its time; 0 where it ends early."""
    later = curve.values[len(curve.values) // 2 :]
    return float(np.nan_to_num(np.max(np.abs(later - curve.target))))


def _table(curves: dict[str, list[_Curve]], shows: str) -> pd.DataFrame:
    parts = [
        pd.DataFrame(
            {
                "initial_condition": name,
                "curve": curve.name,
                "orbits": curve.periods,
                "periods": curve.times,
                shows: curve.values,
            }
        )
        for name, found in curves.items()
        for curve in found
    ]
    return pd.concat(parts, ignore_index=True)
