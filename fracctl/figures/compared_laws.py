"""What the figures of a comparison share: its tables, and one look for each law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import CYCLE, GREY

BOUND: dict[str, Any] = {"color": GREY, "linewidth": 0.9, "linestyle": (0, (4, 2))}
"""Look of the open-loop bound."""

_MARKERS = ("o", "D", "s", "^", "v", "P")
_WORDS = {"pd": "PD", "pd_alpha": r"PD$^{\alpha}$", "pd_lag": "PD with lag", "pid": "PID", "lqr": "LQR"} | {
    "published_pd": "PD, published",
    "published_pd_alpha": r"PD$^{\alpha}$, published",
    "pdd_alpha": r"PDD$^{\alpha}$",
    "pi_lambda_d_mu": r"PI$^{\lambda}$D$^{\mu}$",
}


def compared(results: Results, selection: Selection) -> pd.DataFrame:
    """Return the table of the comparison for the selected initial conditions.

    Raises:
        FigureError: the run is no comparison.
    """
    if results.configuration["evaluation"]["type"] != "comparison":
        raise FigureError("laws are compared by `evaluation: comparison`; this run has another evaluation")
    table = results.run.table("comparison")
    return table[table["initial_condition"].isin(selection.initial_conditions)]


def laws(results: Results) -> list[str]:
    """Return the names of the laws in their order."""
    return list(results.configuration["evaluation"]["laws"])


def look(results: Results, law: str) -> dict[str, Any]:
    """Return colour and marker of a law; the markers are open, for laws often meet in one point."""
    place = laws(results).index(law)
    marker = {"marker": _MARKERS[place % len(_MARKERS)], "markerfacecolor": "none", "markeredgewidth": 0.9}
    return {"color": CYCLE[place % len(CYCLE)], "linewidth": 1.0} | marker


def law_name(law: str) -> str:
    """A law as a reader meets it."""
    return _WORDS.get(law, law.replace("_", " "))


def panel_title(row: pd.Series[Any] | dict[str, Any]) -> str:
    """Initial condition and limit of a panel."""
    value = rf"$\leq {row['limit_value']:g}$"
    limit = f"gains {value}" if row["limit"] == "gain" else f"{value} mm/s²"
    return f"{labels.initial_condition(row['initial_condition'])}, {limit}"


def legend(figure: Figure, results: Results, further: Sequence[Line2D] = ()) -> None:
    """Put the laws below the panels."""
    handles = [Line2D([], [], label=law_name(law), markersize=4.0, **look(results, law)) for law in laws(results)]
    figure.legend(
        handles=[*handles, *further],
        loc="outside lower center",
        ncols=4 if further else 7,
        columnspacing=1.3,
        fontsize=7.5,
    )


def note(ax: Axes, title: str) -> None:
    """Title a small panel, with a faint grid."""
    ax.set_title(title, loc="left", fontsize=7.5, pad=3.0)
    ax.grid(linewidth=0.3, color="0.88")
    ax.tick_params(labelsize=7.0)
