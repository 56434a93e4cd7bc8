"""Poles of the optima, and their verdicts on stability by a second criterion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fracctl.arrays import Array, Complexes, joined
from fracctl.characteristic import CharacteristicMatrix, principal_poles
from fracctl.errors import ArgumentError
from fracctl.evaluation import Evaluation
from fracctl.stability import PseudoStateVerdict, matignon
from fracctl.stability.assess import ON_THE_AXIS
from fracctl.store.columns import SIGMA, W

COLUMNS = ("dominant_pole_real", "dominant_pole_imag", "principal_poles", "all_poles_found")
"""Added to ``optima.parquet``: the principal-sheet pole of largest real part, their number, whether that is proved."""
TABLE_KINDS = ("overall", "baseline")
"""Optima whose poles are in ``poles.parquet``, and which the pseudo-state matrix judges too."""

_Point = tuple[float, ...]


@dataclass
class Poles:
    """Principal-sheet poles of all optima; eigenvalues of the pseudo-state matrix of the overall and baseline ones.

    The argument principle has judged every row already. Where the orders have a common denominator, Matignon's
    criterion must agree; so must the poles found, where all are.
    """

    evaluation: Evaluation
    disagreements: list[str] = field(default_factory=list)
    """A sentence for each optimum on which two criteria disagree."""
    _poles: dict[_Point, tuple[Complexes, bool]] = field(default_factory=dict)
    _verdicts: dict[_Point, PseudoStateVerdict | None] = field(default_factory=dict)
    _parts: list[dict[str, Array]] = field(default_factory=list)

    def add_to(self, optima: Iterable[dict[str, Any]]) -> None:
        """Add `COLUMNS` to the rows of optima."""
        if not self.evaluation.has_poles:
            return
        for run, row in enumerate(optima):
            point = tuple(float(row[name]) for name in self.evaluation.design_variables)
            if point not in self._poles:
                self._poles[point] = principal_poles(CharacteristicMatrix(self._loop(point).system))
            poles, complete = self._poles[point]
            first = poles[0] if len(poles) else complex(np.nan, np.nan)
            row |= dict(zip(COLUMNS, (_number(first.real), _number(first.imag), len(poles), complete), strict=True))
            if row["kind"] in TABLE_KINDS:
                self._judge(run, row, point)

    def rows(self) -> dict[str, Array]:
        """Return the columns of ``poles.parquet``: `run` (row of the optima), `variable`, `denominator`, value."""
        parts = [_part(0, SIGMA, 1, np.zeros(0, dtype=np.complex128)), *self._parts]
        return joined(parts)

    def summary(self) -> dict[str, Any]:
        """Return what the summary of the run says of it; a disagreement fails the run."""
        verdicts = [verdict for verdict in self._verdicts.values() if verdict is not None]
        found = {
            "points": len(self._poles),
            "all_poles_found": sum(complete for _, complete in self._poles.values()),
            "judged_twice": len(verdicts),
            "disagreements": len(self.disagreements),
        }
        if not self.disagreements:
            return {"stability": found}
        error = f"{len(self.disagreements)} verdicts on stability do not agree, e.g. {self.disagreements[0]}"
        return {"stability": found, "status": "failed", "error": error}

    def _loop(self, point: _Point) -> Any:
        return self.evaluation.loop(dict(zip(self.evaluation.design_variables, point, strict=True)))

    def _judge(self, run: int, row: Mapping[str, Any], point: _Point) -> None:
        poles, complete = self._poles[point]
        if point not in self._verdicts:
            self._verdicts[point] = _verdict(self._loop(point))
        verdict = self._verdicts[point]
        self._parts.append(_part(run, SIGMA, 1, poles))
        if verdict is not None:
            self._parts.append(_part(run, W, verdict.denominator, verdict.eigenvalues))
            self._compare(row, verdict.stable, f"the pseudo-state matrix finds {verdict.certificate}")
        if complete and len(poles) and abs(poles[0].real) > ON_THE_AXIS * abs(poles[0]):
            self._compare(row, bool(poles[0].real < 0.0), f"the rightmost pole found is {poles[0]:.6g}")

    def _compare(self, row: Mapping[str, Any], stable: bool | None, reason: str) -> None:
        """Note a verdict that contradicts that of the row; what one of them leaves open is no contradiction."""
        if row["stable"] is None or stable is None or row["stable"] is stable:
            return
        point = ", ".join(f"{name} = {row[name]:g}" for name in self.evaluation.design_variables)
        word = "stable" if row["stable"] else "unstable"
        self.disagreements.append(f"{point}: {word} by the argument principle, but {reason}")


def _verdict(loop: Any) -> PseudoStateVerdict | None:
    """Return the verdict, None where the orders have no common denominator."""
    try:
        return matignon(loop)
    except ArgumentError:
        return None


def _part(run: int, variable: str, denominator: int, values: Complexes) -> dict[str, Array]:
    count = len(values)
    return {
        "run": np.full(count, run),
        "variable": np.full(count, variable, dtype=object),
        "denominator": np.full(count, denominator),
        "real": values.real,
        "imag": values.imag,
    }


def _number(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
