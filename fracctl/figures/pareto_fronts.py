"""Pareto fronts of every pair of objectives, that of the optimised law beside that of the baseline."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection, objective_scale
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, ORANGE
from fracctl.surveys.search_algorithms import non_dominated

_PANEL_HEIGHT_IN = 2.3
_FREE, _HELD = "optimum", "baseline"


@dataclass(frozen=True)
class _Axis:
    """One objective on an axis."""

    column: str
    scale: float
    label: str


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw all points that no other point found is better than in every objective; one row of panels a start.

    Where more than two objectives were minimised together, a panel shows the points in two of them, and as a line
    those that are best in these two.

    Raises:
        FigureError: the run holds no Pareto front.
    """
    fronts = {name: _fronts(results, name) for name in selection.initial_conditions}
    table = pd.concat([part for parts in fronts.values() for part in parts.values()], ignore_index=True)
    axes = [_axis(results, selection, name, table) for name in _objectives(results)]
    pairs = list(itertools.combinations(axes, 2))
    height = _PANEL_HEIGHT_IN * len(fronts) + 0.35
    figure = Figure(figsize=(FULL_WIDTH_IN * min(1.0, 0.4 * len(pairs)), height), layout="constrained")
    panels = figure.subplots(len(fronts), len(pairs), squeeze=False)
    for row, (name, parts) in zip(panels, fronts.items(), strict=True):
        for ax, (x, y) in zip(row, pairs, strict=True):
            _panel(ax, parts, x, y)
        row[0].set_title(labels.initial_condition(name), loc="left")
    words = _words(results)
    drawn = [kind for kind in (_FREE, _HELD) if kind in set(table["kind"])]
    handles = [Line2D([], [], color=_COLOURS[kind], marker="o", markersize=3.0, label=words[kind]) for kind in drawn]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure, table


_COLOURS: Mapping[str, str] = {_FREE: BLUE, _HELD: ORANGE}


def _objectives(results: Results) -> list[str]:
    """Return the objectives that were minimised together."""
    survey = results.configuration["survey"]
    return list(survey.get("objectives") or results.configuration["objectives"])


def _fronts(results: Results, initial_condition: str) -> dict[str, pd.DataFrame]:
    """Return the fronts of all starts together: of what was optimised, and of the baseline."""
    rows = results.evaluations
    if "searched_for" not in rows:
        raise FigureError("Pareto fronts need a search, e.g. survey=search_pareto; this run has none")
    mine = (rows["initial_condition"] == initial_condition) & rows["searched_for"].isna() & (rows["status"] == "ok")
    held = np.ones(len(rows), dtype=bool)
    baseline = results.configuration["survey"].get("baseline") or {}
    for name, value in baseline.items():
        held &= (rows[name] == value).to_numpy()
    columns = [f"objective_{name}" for name in _objectives(results)]
    found = {}
    for kind, where in ((_FREE, ~held if baseline else held), (_HELD, held & bool(baseline))):
        part = rows[mine & where]
        if len(part):
            front = part[non_dominated(part[columns].to_numpy(float))].copy()
            front.insert(0, "kind", kind)
            found[kind] = front.sort_values(columns)
    if not found:
        raise FigureError(f"the run holds no Pareto front for {initial_condition}; survey=search_pareto finds them")
    return found


def _axis(results: Results, selection: Selection, objective: str, table: pd.DataFrame) -> _Axis:
    column, factors = f"objective_{objective}", tuple(results.configuration["objectives"][objective])
    one = Selection(objective, factors, selection.initial_conditions)
    scale, label = objective_scale(results, one)
    power, words = labels.power_of_ten(float(table[column].max()) / scale)
    return _Axis(column, scale * power, label + words)


def _panel(ax: Axes, parts: Mapping[str, pd.DataFrame], x: _Axis, y: _Axis) -> None:
    for kind in (_HELD, _FREE):
        if kind in parts:
            first = parts[kind][x.column].to_numpy(float) / x.scale
            second = parts[kind][y.column].to_numpy(float) / y.scale
            ax.plot(first, second, ".", color=_COLOURS[kind], markersize=2.4, alpha=0.4, markeredgewidth=0.0)
            best = non_dominated(np.stack([first, second], axis=1))
            order = np.argsort(first[best])
            ax.plot(first[best][order], second[best][order], color=_COLOURS[kind], drawstyle="steps-post", zorder=3)
    ax.set_xlabel(x.label)
    ax.set_ylabel(y.label)


def _words(results: Results) -> dict[str, str]:
    """Return what the two fronts are called."""
    baseline = results.configuration["survey"].get("baseline") or {}
    if not baseline:
        return {_FREE: "optimised"}
    return {_FREE: f"{_symbols(list(baseline))} free", _HELD: ", ".join(_held(baseline))}


def _symbols(names: Sequence[str]) -> str:
    return ", ".join(f"${labels.symbol(name)}$" for name in names)


def _held(values: Mapping[str, float]) -> list[str]:
    return [f"${labels.symbol(name)} = {value:g}$" for name, value in values.items()]
