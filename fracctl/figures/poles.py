"""Eigenvalues of the pseudo-state matrix with the sector of stability, and the poles that they stand for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.arrays import Booleans, Complexes
from fracctl.errors import RunError
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Row, Selection, optimum, same_point
from fracctl.figures.style import BLUE, FULL_WIDTH_IN, GREY, ORANGE
from fracctl.store.columns import SIGMA, W

_PANEL_HEIGHT_IN = 3.3
_MARGIN_HEIGHT_IN = 0.45
_STABLE = "#DCEBF5"
_COLOURS = {"baseline": ORANGE, "overall": BLUE}
_CROSSES: Mapping[str, dict[str, Any]] = {
    "baseline": {"marker": "+", "markersize": 8.0},
    "overall": {"marker": "x", "markersize": 6.5},
}
_OTHERS: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 2.0, "color": "0.45", "mew": 0.0}
_FEWEST_SHEETS = 4
"""From this denominator on the principal sheet is a narrow wedge, and shown enlarged."""
_MARGIN = 1.25
"""Axes reach this far beyond what they show."""


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw eigenvalues w of the optimum (left) and principal-sheet poles σ of optimum and baseline (right).

    Shaded is where eigenvalues of a stable loop lie, |arg w| > π/(2q) = απ/2 with α = 1/q, as in Figure 1 of the
    paper, and Re σ < 0. Coloured eigenvalues have |arg w| < π/q: they are the poles σ = w^q on the right.

    Raises:
        FigureError: the run holds no poles of an optimum.
    """
    table = _table(results, selection)
    names = selection.initial_conditions
    height = _PANEL_HEIGHT_IN * len(names) + _MARGIN_HEIGHT_IN
    figure = Figure(figsize=(FULL_WIDTH_IN, height), layout="constrained")
    axes = figure.subplots(len(names), 2, squeeze=False)
    for name, (left, right) in zip(names, axes, strict=True):
        rows = table[table["initial_condition"] == name]
        kinds = [kind for kind in _COLOURS if (rows["kind"] == kind).any()]
        _eigenvalues(left, rows[(rows["kind"] == kinds[-1]) & (rows["variable"] == W)], kinds[-1])
        left.set_title(f"{labels.initial_condition(name)}: pseudo-state matrix of the optimum", loc="left")
        of = {kind: rows[(rows["kind"] == kind) & (rows["variable"] == SIGMA)] for kind in kinds}
        _poles(right, {kind: _values(part) for kind, part in of.items()}, _points(results, selection, name))
    return figure, table


def _points(results: Results, selection: Selection, initial_condition: str) -> dict[str, Row]:
    """Optimum and baseline, only the baseline where they are one point."""
    found: dict[str, Row] = {}
    for kind in _COLOURS:
        row = optimum(results, selection, initial_condition, kind)
        if row is not None and not any(same_point(row, other) for other in found.values()):
            found[kind] = row
    if not found:
        raise FigureError(f"no optimum of {selection.objective} is stored for '{initial_condition}'")
    return found


def _table(results: Results, selection: Selection) -> pd.DataFrame:
    """Poles and eigenvalues with the initial condition, the kind of optimum, and whether on the principal sheet."""
    try:
        poles, parts = results.poles, []
    except RunError as problem:
        raise FigureError(f"the run holds no poles ({problem})") from problem
    for name in selection.initial_conditions:
        for kind, row in _points(results, selection, name).items():
            part = poles[poles["run"] == row["run"]].drop(columns="run").reset_index(drop=True)
            part.insert(0, "kind", kind)
            part.insert(0, "initial_condition", name)
            parts.append(part)
    table: pd.DataFrame = pd.concat(parts, ignore_index=True)
    angle = np.abs(np.arctan2(table["imag"], table["real"]))
    table["principal"] = (table["denominator"] == 1) | (angle * table["denominator"] < math.pi * (1.0 - 1e-8))
    return table


def _values(rows: pd.DataFrame) -> Complexes:
    return rows["real"].to_numpy(float) + 1j * rows["imag"].to_numpy(float)


def _eigenvalues(ax: Axes, rows: pd.DataFrame, kind: str) -> None:
    """Draw the w-plane; the wedge of the principal sheet enlarged inside the ring of the eigenvalues."""
    ax.set_xlabel(r"$\mathrm{Re}\,w$")
    ax.set_ylabel(r"$\mathrm{Im}\,w$")
    if rows.empty:
        ax.text(0.5, 0.5, "orders without a\ncommon denominator", ha="center", va="center", transform=ax.transAxes)
        return
    q, principal = int(rows["denominator"].iloc[0]), rows["principal"].to_numpy(bool)
    values = _values(rows)
    reach = _MARGIN * float(np.abs(values).max())
    enlarged = q >= _FEWEST_SHEETS and bool(principal.any())
    _plane(ax, values, principal, q, {**_OTHERS, "color": _COLOURS[kind]} if enlarged else _crosses(kind))
    ax.set_aspect("equal")
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    if enlarged:
        _enlarged(ax, values, principal, q, kind)
    else:
        _axes_lines(ax)


def _enlarged(ax: Axes, values: Complexes, principal: Booleans, q: int, kind: str) -> None:
    """Draw the principal sheet near its eigenvalues in an inset."""
    inside = values[principal]
    centre = 0.5 * (inside.real.min() + inside.real.max())
    half = _MARGIN * max(float(np.ptp(inside.real)) / 2.0, centre * math.tan(math.pi / q))
    inset = ax.inset_axes((0.27, 0.25, 0.46, 0.5))
    _plane(inset, values, principal, q, _crosses(kind))
    inset.set_aspect("equal")
    inset.set_xlim(centre - half, centre + half)
    inset.set_ylim(-half, half)
    inset.locator_params(nbins=3)
    inset.tick_params(labelsize=6.5)
    inset.set_title(rf"$|\arg w| < \pi/{q}$: principal sheet", fontsize=7, pad=2.5)
    ax.indicate_inset_zoom(inset, edgecolor=GREY, linewidth=0.5)


def _plane(ax: Axes, values: Complexes, principal: Booleans, q: int, marks: Mapping[str, Any]) -> None:
    """Draw the sector of stability, the border of the principal sheet and the eigenvalues, those on it with `marks`."""
    ax.set_facecolor(_STABLE)
    far = 10.0 * float(np.abs(values).max())
    edge = far * np.exp(0.5j * math.pi / q)
    ax.fill([0.0, edge.real, far, edge.real, 0.0], [0.0, edge.imag, 0.0, -edge.imag, 0.0], color="white", zorder=0)
    if q == 1:
        ax.fill([0.0, far, far, 0.0], [far, far, -far, -far], color="white", zorder=0)
    else:
        sheet = far * np.exp(1j * math.pi / q)
        for sign in (1.0, -1.0):
            ax.plot([0.0, sheet.real], [0.0, sign * sheet.imag], color=GREY, linewidth=0.5, linestyle=(0, (4, 3)))
    for part, look in ((values[~principal], _OTHERS), (values[principal], marks)):
        ax.plot(part.real, part.imag, **{"zorder": 3, **look})


def _poles(ax: Axes, poles: Mapping[str, Complexes], points: Mapping[str, Row]) -> None:
    """Draw the σ-plane with the left half shaded."""
    reach = _MARGIN * (max(float(np.abs(values).max(initial=0.0)) for values in poles.values()) or 1.0)
    ax.axvspan(-2.0 * reach, 0.0, color=_STABLE, zorder=0, linewidth=0.0)
    _axes_lines(ax)
    for kind, values in poles.items():
        label = labels.controller(points[kind])
        ax.plot(values.real, values.imag, label=label, **_crosses(kind))
    ax.set_xlim(-reach, 0.3 * reach if max(v.real.max(initial=0.0) for v in poles.values()) <= 0.0 else reach)
    ax.set_ylim(-reach, reach)
    ax.set_xlabel(r"$\mathrm{Re}\,\sigma$")
    ax.set_ylabel(r"$\mathrm{Im}\,\sigma$")
    ax.set_title("Principal-sheet poles (shaded: stable)", loc="left")
    ax.set_box_aspect(1.0)
    ax.legend(loc="upper left", fontsize=7.0, handletextpad=0.3, borderaxespad=0.3)


def _crosses(kind: str) -> dict[str, Any]:
    return {"linestyle": "none", "markeredgewidth": 1.4, "color": _COLOURS[kind], **_CROSSES[kind]}


def _axes_lines(ax: Axes) -> None:
    ax.axhline(0.0, color=GREY, linewidth=0.5, zorder=1)
    ax.axvline(0.0, color=GREY, linewidth=0.5, zorder=1)
