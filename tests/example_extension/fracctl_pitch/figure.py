"""Rate against angle."""

import pandas as pd
from matplotlib.figure import Figure

from fracctl.figures.results import Results, Selection


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw the best trajectories from the selected starts in the phase plane; return it, and the table behind it."""
    (name,) = results.components
    best = results.optima[results.optima["objective_name"] == selection.objective]
    paths = results.trajectories[results.trajectories["run"].isin(best.index)]
    figure = Figure(figsize=(3.5, 3.0), layout="constrained")
    ax = figure.subplots()
    for run, path in paths.groupby("run"):
        start = best.loc[run, "initial_condition"]
        if start in selection.initial_conditions:
            ax.plot(path[name], path[f"{name}_dot"], label=f"{best.loc[run, 'kind']} from {start}")
    ax.set_xlabel("Angle (rad)")
    ax.set_ylabel("Rate")
    ax.legend()
    return figure, paths
