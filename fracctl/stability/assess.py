"""Stability of a linear fractional loop: by the argument principle, with periodic coefficients by its multipliers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fracctl.arrays import Complexes
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.poles import principal_poles
from fracctl.characteristic.winding import unstable_zeros
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop, Need

ON_THE_AXIS = 1e-9
"""|Re σ|/|σ| of a pole whose side is not decided."""
ON_THE_CIRCLE = 1e-5
"""Distance from 1 of a multiplier whose side is not decided: what the modes of the memory leave open."""


@dataclass(frozen=True)
class Verdict:
    """Whether a loop is asymptotically stable, and why."""

    stable: bool | None
    """True, False, or None where a pole lies on the imaginary axis to rounding and none is known to lie beyond."""
    poles: Complexes
    """Principal-sheet poles, by descending real part, dimensionless; with periodic coefficients Floquet's exponents."""
    certificate: str
    """The count that proves the verdict."""
    method: str = "argument principle on the imaginary axis"


def assess(loop: ClosedLoop) -> Verdict:
    """Return the verdict for a single loop.

    A loop of commensurate or any real orders is stable exactly if det M(σ) has no zero with Re σ ≥ 0 (Matignon
    1996; Yaylali, Butcher, Sinclair, Eq. 22 in the pseudo-state form). With coefficients of the plant's period it is
    where all Floquet multipliers are inside the unit circle, see `memory_multipliers`.

    Raises:
        ArgumentError: the loop is a batch.
        UnsupportedError: a term has the highest order of its coordinate, or the loop is not linear.
    """
    if loop.batch is not None:
        raise ArgumentError("loop", f"a batch of {loop.batch}", "must be a single loop; solve a batch for its verdicts")
    if Need.PERIODIC_PLANT in loop.needs:
        return _periodic(loop)
    matrix = CharacteristicMatrix(loop.system)
    zeros, marginal = unstable_zeros(matrix)
    poles, complete = principal_poles(matrix)
    found = f"{len(poles)} principal-sheet poles found{'' if complete else ', not all'}"
    count = int(zeros[0])
    if marginal[0]:
        besides = f", {count} zeros of uncoupled coordinates have Re σ > 0" if count else ""
        return Verdict(False if count else None, poles, f"det M vanishes on the imaginary axis{besides}; {found}")
    if count == 0 and len(poles) and poles[0].real > ON_THE_AXIS * abs(poles[0]):
        return Verdict(False, poles, f"a pole at {poles[0]:.3g}, though none is counted; {found}")
    return Verdict(count == 0, poles, f"{count} zeros of det M with Re σ > 0; {found}")


def _periodic(loop: ClosedLoop) -> Verdict:
    from fracctl.stability.modal_floquet import memory_multipliers  # loads SciPy's linear algebra

    plant: Any = loop.plant
    found = memory_multipliers(loop)
    exponents = np.log(found.values[found.isolated & (found.values != 0.0)]) / plant.period
    told = f"largest isolated multiplier {found.largest:.4g}, of relaxation {found.slowest_relaxation:.4g}"
    stable = None if abs(found.largest - 1.0) <= ON_THE_CIRCLE else found.stable
    return Verdict(
        stable, exponents, f"{told}; {found.modes} modes a signal", "Floquet multipliers of modes for the memory"
    )
