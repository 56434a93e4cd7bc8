"""Stored trajectories as curves that can be read at any time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.interpolate import CubicHermiteSpline

from fracctl.arrays import Floats
from fracctl.figures.results import FigureError, Results, Row, Selection, optimum, same_point


@dataclass(frozen=True)
class Curve:
    """The trajectory of one optimum, or of one of several laws."""

    kind: str
    """baseline or overall."""
    best: Row
    """The row of optima, or of laws."""
    samples: pd.DataFrame
    """The rows of its trajectory, in the order of time."""
    components: tuple[str, ...]
    """Names of the positions."""
    place: int | None = None
    """Of the law among several, whose name is `kind` then."""
    held: bool = False
    """Whether controls are constant from each sample to the next."""

    @property
    def times(self) -> Floats:
        """Times of the samples."""
        return self.samples["time"].to_numpy(float)

    @property
    def settling_time(self) -> float:
        """The settling time, infinite where it was not reached or not measured."""
        return float(self.best.get("settling_time", math.inf))

    def values(self, column: str, times: Floats) -> Floats:
        """A state or a control at any times; positions by cubic Hermite interpolation with their rates."""
        samples = self.samples[column].to_numpy(float)
        if self.held and column.startswith("control_"):
            return samples[np.searchsorted(self.times, times, side="right") - 1]
        if f"{column}_dot" not in self.samples:
            return np.asarray(np.interp(times, self.times, samples))
        rates = self.samples[f"{column}_dot"].to_numpy(float)
        return np.asarray(CubicHermiteSpline(self.times, samples, rates)(times), dtype=float)

    def last_to_settle(self, threshold: float) -> str | None:
        """The position that crosses the threshold at the settling time, None where there is no such time."""
        if not math.isfinite(self.settling_time):
            return None
        time = np.array([self.settling_time])
        distances = {name: abs(abs(self.values(name, time)[0]) - threshold) for name in self.components}
        return min(distances, key=distances.__getitem__)

    def last_time_above(self, component: str, level: float) -> float:
        """Time of the last sample above a level, 0 if none is."""
        above = np.flatnonzero(np.abs(self.values(component, self.times)) > level)
        return float(self.times[above[-1]]) if above.size else 0.0


def curves_of(results: Results, selection: Selection, initial_condition: str) -> list[Curve]:
    """Return the curves of baseline and overall optimum, only one where they are the same point, or of all laws.

    Raises:
        FigureError: there is no stored trajectory.
    """
    if results.flies_laws:
        return _of_laws(results, initial_condition)
    curves: list[Curve] = []
    for kind in ("baseline", "overall"):
        best = optimum(results, selection, initial_condition, kind)
        if best is None or any(same_point(best, curve.best) for curve in curves):
            continue
        samples = results.trajectories[results.trajectories["run"] == best["run"]].sort_values("time")
        if not samples.empty:
            curves.append(Curve(kind, best, samples, results.components))
    if not curves:
        raise FigureError(_missing(results, selection, initial_condition))
    return curves


def _missing(results: Results, selection: Selection, initial_condition: str) -> str:
    if "stage" in results.columns:
        cure = "evaluation.samples=1 evaluation.first_sample=NUMBER, or evaluation.noise_samples=1 where it ends before"
        return f"paths are kept of several laws with one flight at the last stage; take {cure}"
    return f"no trajectory of an optimum of {selection.objective} is stored for '{initial_condition}'"


def _of_laws(results: Results, initial_condition: str) -> list[Curve]:
    paths, rows = (results.run.table(name) for name in ("paths", "laws"))
    curves = []
    for place, law in enumerate(results.configuration["evaluation"]["laws"]):
        own, row = (t[(t["law"] == law) & (t["initial_condition"] == initial_condition)] for t in (paths, rows))
        if not own.empty:
            best = {str(name): value for name, value in row.iloc[0].items()}
            samples, held = own.drop(columns=["initial_condition", "law", "stage"]), own["stage"].iloc[0] != "ideal"
            curves.append(Curve(law, best, samples, results.components, place, held))
    if not curves:
        raise FigureError(f"no law has flown from '{initial_condition}'")
    return curves


def table_of(curves: Mapping[str, Sequence[Curve]]) -> pd.DataFrame:
    """Return the samples of all curves by initial condition, one after the other."""
    parts = []
    for initial_condition, pair in curves.items():
        for curve in pair:
            part = curve.samples.drop(columns="run", errors="ignore").reset_index(drop=True)
            part.insert(1, "periods", curve.times / math.tau)
            part.insert(0, "kind", curve.kind)
            part.insert(0, "initial_condition", initial_condition)
            parts.append(part)
    return pd.concat(parts, ignore_index=True)
