"""How measures of a dispersed run are distributed."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fracctl.errors import suggestion
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Selection, showing
from fracctl.figures.style import CYCLE, FULL_WIDTH_IN, GREY

_PANEL_HEIGHT_IN = 2.3
_ABREAST = 3
_MOST = 6


@showing(None)
def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw the share of samples up to each value, a panel for each measure and a curve for each law and start.

    The option `shows` names measures, separated by commas; the first six that vary without it, of which times in orbits
    stand for the same in other units. Flights are those of one stage, the option `stage` or the last. Samples without a
    finite value are missing at the top of a curve.

    Raises:
        FigureError: the run is not dispersed, or has no such measure or stage.
    """
    if "sample" not in results.columns:
        raise FigureError("the run is not dispersed")
    wanted = {"initial_condition": selection.initial_conditions, **_stage(results, selection)}
    measures = _measures(results, wanted, selection)
    groups = ["initial_condition", *(["law"] if "law" in results.columns else [])]
    held = ["sample", *groups, *(name for name in wanted if name not in groups), *measures]
    own = results.run.evaluations_where(wanted, list(dict.fromkeys(held)))
    lines = -(-len(measures) // _ABREAST)
    width = min(_ABREAST, len(measures))
    figure = Figure(figsize=(FULL_WIDTH_IN, _PANEL_HEIGHT_IN * lines + 0.3), layout="constrained")
    axes = figure.subplots(lines, width, squeeze=False, sharey=True).ravel()
    for ax, measure in zip(axes, measures, strict=False):
        for colour, (key, part) in zip(CYCLE, own.groupby(groups, sort=False), strict=False):
            _steps(ax, part[measure].to_numpy(float), colour, _name(key, len(selection.initial_conditions)))
        ax.axhline(0.95, color=GREY, linewidth=0.4, linestyle=":")
        ax.set_xlabel(labels.objective([measure]))
    for ax in axes[len(measures) :]:
        ax.set_axis_off()
    for ax in axes[::width]:
        ax.set_ylabel("Share of samples")
    handles, names = axes[0].get_legend_handles_labels()
    if "stage" in own:
        figure.suptitle(f"flights {own['stage'].iloc[0]}", fontsize=8.5)
    figure.legend(handles, names, loc="outside lower center", ncols=min(len(names), 4))
    return figure, own


def _stage(results: Results, selection: Selection) -> dict[str, tuple[str]]:
    """Return the one stage whose flights are shown, nothing where there are none."""
    if "stage" not in results.columns:
        return {}
    stages = list(dict.fromkeys(results.run.evaluations(["stage"])["stage"]))
    stage = selection.stage or stages[-1]
    if stage not in stages:
        raise FigureError(f"the run has no flights {stage}; it has {', '.join(stages)}{suggestion(stage, stages)}")
    return {"stage": (stage,)}


def _measures(results: Results, wanted: Mapping[str, Sequence[str]], selection: Selection) -> list[str]:
    if selection.shows:
        shown = [name.strip() for name in selection.shows.split(",")]
        if missing := [name for name in shown if name not in results.columns]:
            raise FigureError(f"the run does not measure {', '.join(missing)}{suggestion(missing[0], results.columns)}")
        return shown
    after = results.columns[results.columns.index("sample") + 1 :]
    drawn = set(results.configuration["evaluation"].get("dispersions", {})) | {"error_estimate", "nodes"}
    drawn |= {again for name in after if f"{name}_orbits" in after for again in (name, f"{name}_min")}
    varying = (name for name in after if name not in drawn and _varies(results, wanted, name))
    found = list(itertools.islice(varying, _MOST))
    if not found:
        raise FigureError("no measure of the run varies")
    return found


def _varies(results: Results, wanted: Mapping[str, Sequence[str]], name: str) -> bool:
    values = results.run.evaluations_where(wanted, [*wanted, name])[name]
    return values.dtype == float and values.nunique() > 2


def _steps(ax: Axes, values: np.ndarray, colour: str, name: str) -> None:
    finite = np.sort(values[np.isfinite(values)])
    shares = np.arange(1, len(finite) + 1) / max(len(values), 1)
    ax.step(finite, shares, where="post", color=colour, linewidth=1.0, label=name)


def _name(key: object, starts: int) -> str:
    parts = [str(part) for part in key] if isinstance(key, tuple) else [str(key)]
    start = [labels.initial_condition(parts[0])] if starts > 1 or len(parts) == 1 else []
    return ", ".join([*parts[1:], *start])
