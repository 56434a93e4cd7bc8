"""The figures: evaluations a second, and error against time of the solvers and of other people's packages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.throughput import ASKED
from fracctl.figures.style import BLUE, CYCLE, FULL_WIDTH_IN, GREEN, GREY, ORANGE, render, style

_PLANES = ("out-of-plane", "in-plane")
_SOLVERS: dict[str, dict[str, Any]] = {
    "contour": {"color": BLUE, "marker": "o"},
    "volterra": {"color": GREEN, "marker": "s"},
    "collocation": {"color": ORANGE, "marker": "^"},
}
_PEERS: dict[tuple[str, str], dict[str, Any]] = {
    ("pycaputo", "implicit product integration"): {"color": CYCLE[3], "marker": "v"},
    ("nilt-python", "de Hoog"): {"color": CYCLE[4], "marker": "D"},
    ("nilt-python", "fixed Talbot"): {"color": CYCLE[5], "marker": "P"},
    ("pymittagleffler", "closed solution"): {"color": GREY, "marker": "X"},
}
_BESIDE: dict[str, Any] = {
    "textcoords": "offset points",
    "va": "center",
    "fontsize": 7.0,
    "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.8},
}


def write(folder: Path, figures: dict[str, Figure]) -> list[Path]:
    """Write each figure as PDF and PNG."""
    paths = []
    for name, figure in figures.items():
        with style():
            for kind, content in render(figure).items():
                path = folder / f"{name}.{kind}"
                path.write_bytes(content)
                paths.append(path)
    return paths


def throughput(table: pd.DataFrame) -> Figure:
    """Draw the rates as bars, the bare products above them, a line where the asked rate is."""
    with style():
        figure = Figure(figsize=(FULL_WIDTH_IN, 3.9), layout="constrained")
        shown = [table[table["plane"] == plane].iloc[::-1] for plane in _PLANES]
        axes = figure.subplots(2, 1, height_ratios=[len(rows) for rows in shown], sharex=True)
        for ax, plane, rows in zip(axes, _PLANES, shown, strict=True):
            bare = rows["batch"].str.startswith("the bare")
            words = rows["batch"].where(~bare, "bare products (the limit)")
            ax.barh(words, rows["evaluations a second"], color=[GREY if b else BLUE for b in bare], height=0.66)
            ax.axvline(ASKED[plane], color=ORANGE, linewidth=1.0, linestyle=(0, (4, 3)))
            ax.set_title(plane.capitalize(), loc="left", fontweight="bold")
            ax.tick_params(axis="y", length=0.0)
            for y, rate in enumerate(rows["evaluations a second"]):
                ax.annotate(f"{rate / 1e3:.0f} k", (rate, y), (3, 0), **_BESIDE)
        above = {"transform": axes[0].get_xaxis_transform(), "ha": "center", "va": "bottom"}
        axes[0].text(ASKED["out-of-plane"], 1.02, "asked", color=ORANGE, fontsize=8.0, **above)
        axes[1].set_xlim(0.0, 1.1 * table["evaluations a second"].max())
        axes[1].xaxis.set_major_formatter(lambda rate, _: f"{rate / 1e3:.0f} k")
        axes[1].set_xlabel("Evaluations a second on one core")
        return figure


def work_precision(solvers: pd.DataFrame, peers: pd.DataFrame) -> Figure:
    """Draw error against time per trajectory, one panel a plane; solvers full, peers hollow."""
    with style():
        figure = Figure(figsize=(FULL_WIDTH_IN, 3.4), layout="constrained")
        axes = figure.subplots(1, 2, sharex=True, sharey=True)
        for ax, plane in zip(axes, _PLANES, strict=True):
            for name, look in _SOLVERS.items():
                _curve(ax, solvers[(solvers["plane"] == plane) & (solvers["solver"] == name)], f"fracctl, {name}", look)
            ladder = peers[(peers["plane"] == plane) & (peers["ladder"].eq(True))]
            for (package, method), look in _PEERS.items():
                rows = ladder[(ladder["package"] == package) & (ladder["method"] == method)]
                _curve(ax, rows, f"{package}, {method}", {**look, "markerfacecolor": "white", "linewidth": 0.8})
            ax.set(xscale="log", yscale="log", xlabel="Time per trajectory on one core, ms")
            ax.set_title(plane.capitalize(), loc="left", fontweight="bold")
        axes[0].set_ylabel("Largest error of $x$ and $\\upsilon$, relative to the peak")
        handles, words = axes[0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside lower center", ncols=3, columnspacing=1.2)
        return figure


def _curve(ax: Axes, rows: pd.DataFrame, words: str, look: dict[str, Any]) -> None:
    """Draw the settings that no other one of the same method beats in both time and error."""
    ordered = rows.sort_values("ms")
    best = ordered[ordered["error"] < ordered["error"].cummin().shift(fill_value=float("inf"))]
    if len(best):
        ax.plot(best["ms"], best["error"], label=words, **look)
