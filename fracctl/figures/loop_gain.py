"""Loop gains of optimum and baseline as figures show them, with the margins that can be read off them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from fracctl.arrays import Array, Complexes, Floats
from fracctl.errors import RunError
from fracctl.figures import labels
from fracctl.figures.results import FigureError, Results, Row, Selection, optimum, same_point
from fracctl.figures.style import BLUE, ORANGE

COLOURS = {"baseline": ORANGE, "overall": BLUE}
"""By kind of optimum."""
_BEYOND = 1e3
"""Loop gains this large are at a pole of the plant: no crossing of the real axis there is one."""


@dataclass(frozen=True)
class LoopGain:
    """L(iω) of one optimum; with several controls det(I + L) - 1."""

    kind: str
    row: Row
    omega: Floats
    values: Complexes
    sensitivity: Floats

    @property
    def label(self) -> str:
        """The law with its parameters."""
        return labels.controller(self.row)

    @property
    def phase_margin(self) -> tuple[float, float] | None:
        """ω with |L| = 1 where the phase is nearest to ±180°, and that phase in degrees; None where |L| is never 1."""
        size = np.log(np.abs(self.values))
        omega, phase = self._crossings(size, np.abs(size) < np.log(_BEYOND), np.angle(self.values))
        if not omega.size:
            return None
        worst = int(np.abs(phase).argmax())
        return float(omega[worst]), float(np.degrees(phase[worst]))

    @property
    def gain_margin(self) -> tuple[float, float] | None:
        """ω where L crosses the negative real axis at a size nearest to 1, and that |L|; None where it does not."""
        size = np.log(np.abs(self.values))
        near = (self.values.real < 0.0) & (np.abs(size) < np.log(_BEYOND))
        omega, crossed = self._crossings(self.values.imag, near, size)
        if not omega.size:
            return None
        nearest = int(np.abs(crossed).argmin())
        return float(omega[nearest]), float(np.exp(crossed[nearest]))

    def _crossings(self, values: Floats, allowed: Array, wanted: Floats) -> tuple[Floats, Floats]:
        """Return where values change sign, and what `wanted` is there, both linear in log ω."""
        (at,) = np.nonzero((values[:-1] * values[1:] < 0.0) & allowed[:-1] & allowed[1:])
        share = values[at] / (values[at] - values[at + 1])
        log = np.log(self.omega)
        return np.exp(log[at] + share * (log[at + 1] - log[at])), wanted[at] + share * (wanted[at + 1] - wanted[at])


def loop_gains(results: Results, selection: Selection, initial_condition: str) -> list[LoopGain]:
    """Return those of baseline and optimum, of the baseline alone where they are one point.

    Raises:
        FigureError: the run holds no frequency responses, or no optimum.
    """
    try:
        table = results.frequency_response
    except RunError as problem:
        cure = "compute it again with --fresh"
        raise FigureError(f"the run holds no frequency responses ({problem}); {cure}") from problem
    found: list[LoopGain] = []
    for kind in COLOURS:
        row = optimum(results, selection, initial_condition, kind)
        if row is None or any(same_point(row, other.row) for other in found):
            continue
        part = table[table["run"] == row["run"]]
        omega, real, imag, sensitivity = (
            part[name].to_numpy(float) for name in ("frequency", "loop_real", "loop_imag", "sensitivity")
        )
        found.append(LoopGain(kind, row, omega, real + 1j * imag, sensitivity))
    if not found:
        raise FigureError(f"no optimum of {selection.objective} is stored for '{initial_condition}'")
    return found


def table_of(gains: dict[str, list[LoopGain]]) -> pd.DataFrame:
    """Return the numbers behind a figure, loop gains by initial condition."""
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "initial_condition": name,
                    "kind": gain.kind,
                    "frequency": gain.omega,
                    "magnitude": np.abs(gain.values),
                    "phase_deg": np.degrees(np.angle(gain.values)),
                    "real": gain.values.real,
                    "imag": gain.values.imag,
                    "sensitivity": gain.sensitivity,
                }
            )
            for name, several in gains.items()
            for gain in several
        ],
        ignore_index=True,
    )
