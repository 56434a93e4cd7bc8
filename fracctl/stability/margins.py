"""Stability margins of linear loops with memory, from their exact frequency response."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.characteristic.winding import unstable_zeros, verdicts
from fracctl.loop import ClosedLoop
from fracctl.plants.linear import LinearPlant
from fracctl.stability.extremes import largest, roots
from fracctl.stability.frequency import NEXT_TO_ZERO, FrequencyResponse, over

_AT_ONCE = 512
"""Members whose curves are held in memory together."""
_REAL = 1e-9
"""|Im L| over |L| of a loop gain that is real at frequency 0."""
_VANISHING = 1e-50
"""Below it a factor stands for 0, and above its inverse for infinity: those are limits at frequency 0."""

_Pair = tuple[Complexes, Complexes]
"""C and M, (n, k, m, m)."""


@dataclass(frozen=True)
class Margins:
    """How far loops are from instability; (b,) each, or a number for a single loop.

    With L the loop gain at the plant's input, S = (I + L)⁻¹ and T = L S. Of a loop that is not stable all are NaN.
    Those of one control, down to the delay, are NaN for plants with several: there one axis at a time says little.
    """

    stable: Any
    """As that of `Verdict`."""
    gain_margin: Any
    """The least factor above 1 on the control with which a pole reaches the axis; inf if there is none."""
    gain_reduction: Any
    """The largest factor below 1 with which a pole reaches the axis; 0 if there is none."""
    phase_margin_deg: Any
    """The least |phase| that, put into the loop, brings a pole to the axis; inf where |L| is never 1."""
    crossover: Any
    """Frequency ω, with |L(iω)| = 1, of the phase margin."""
    delay_margin: Any
    """The least delay of the control that brings a pole to the axis, dimensionless; inf where |L| is never 1."""
    delay_margin_s: Any
    """The same in seconds; NaN for a plant without scales."""
    sensitivity_peak: Any
    """M_s = max σ_max(S(iω)); for one control 1/M_s is the distance of L(iω) from -1."""
    sensitivity_frequency: Any
    """ω of M_s; inf where M_s = 1 is the limit at high frequencies."""
    complementary_peak: Any
    """M_t = max σ_max(T(iω))."""
    disk_margin: Any
    """α = 2 / max σ_max(S - T), from 0 to 2: the loop is stable with every F = (I + Δ/2)(I - Δ/2)⁻¹, |Δ| < α, in it."""

    @property
    def gain_margin_db(self) -> Any:
        """The gain margin in decibels, positive."""
        return _db(self.gain_margin)

    @property
    def gain_reduction_db(self) -> Any:
        """The gain reduction in decibels, negative."""
        return _db(self.gain_reduction)

    @property
    def disk_gain_margin(self) -> Any:
        """γ = (2 + α)/(2 - α): gains of all controls may change at once, each by a factor between 1/γ and γ."""
        with np.errstate(divide="ignore"):
            return np.divide(2.0 + self.disk_margin, 2.0 - self.disk_margin)

    @property
    def disk_gain_margin_db(self) -> Any:
        """The same in decibels."""
        return _db(self.disk_gain_margin)

    @property
    def disk_phase_margin_deg(self) -> Any:
        """2 atan(α/2): phases of all controls may change at once, each by as much."""
        return np.degrees(2.0 * np.arctan(0.5 * self.disk_margin))


def margins(loop: ClosedLoop) -> Margins:
    """Return the margins of a single loop or of a batch.

    Gain, phase and delay: all crossings of |L| = 1 and of the negative real axis, frequency 0 included, from a
    logarithmic grid (`FrequencyResponse.grid`) by bisection; the worst crossing counts. Peaks: by the golden section,
    and the limits at ω = 0 and ∞. Disk margin: symmetric, skew 0 (Seiler, Packard, Gahinet, "An introduction to disk
    margins", IEEE Control Systems 40(5) (2020) 78), with one full Δ for all controls, so it holds for cross-coupling
    too, and is a lower bound where only the diagonal of Δ is meant.

    Args:
        loop: of a linear plant and a linear law; a saturation plays no part.

    Raises:
        UnsupportedError: the loop is not linear, has delays, or a term of the highest order of its coordinate.
    """
    response = FrequencyResponse(loop)
    stable = verdicts(*unstable_zeros(response.matrix))
    found: dict[str, Array] = {field.name: np.full(response.batch, np.nan) for field in fields(Margins)}
    found["stable"] = stable
    sound = np.flatnonzero(np.equal(stable, True))
    grid = response.grid()
    for first in range(0, sound.size, _AT_ONCE):
        rows = sound[first : first + _AT_ONCE]
        for name, column in of_response(response, rows, grid).items():
            found[name][rows] = column
    assert isinstance(loop.plant, LinearPlant)
    if loop.plant.scales is not None:
        found["delay_margin_s"] = found["delay_margin"] * loop.plant.scales.time_s
    return Margins(**({name: column.tolist()[0] for name, column in found.items()} if loop.batch is None else found))


class Response(Protocol):
    """Controller and plant as matrices C and M over frequency, with the loop gain L = C M⁻¹."""

    controls: int
    """Number m of controls."""
    ends: tuple[float, ...]
    """Frequencies at which L is looked at beside the grid: next to 0, and where there is one the highest."""

    def __call__(self, omega: Floats, rows: Array) -> _Pair:
        """Return C and M of the members `rows` (n,) at frequencies (1, k) or (n, k), (n, k, m, m) each."""
        ...


def of_response(response: Response, rows: Array, grid: Floats) -> dict[str, Floats]:
    """Return the fields of `Margins` for stable members (n,) whose curves a grid (k,) resolves, (n,) each."""
    on_grid = response(grid[None], rows)
    values = _peaks(response, rows, grid, on_grid)
    if response.controls == 1:
        values |= _gain_margins(response, rows, grid, on_grid) | _phase_margins(response, rows, grid, on_grid)
    return values


def _peaks(response: Response, rows: Array, grid: Floats, on_grid: _Pair) -> dict[str, Floats]:
    """Return peaks of S, T and S - T with their limits at both ends."""
    names = ("sensitivity_peak", "complementary_peak", "disk_margin")
    found, members = {}, np.arange(rows.size)
    for kind, (name, limit) in enumerate(zip(names, (1.0, 0.0, 1.0), strict=True)):

        def curve(omega: Floats, members: Array, kind: int = kind) -> Floats:
            return _sensitivity(response(omega, rows[members]), kind)

        value, where = largest(curve, grid, _sensitivity(on_grid, kind))
        for end in response.ends:
            there = curve(np.full((1, 1), end), members)[:, 0]
            value, where = np.maximum(value, there), np.where(there > value, 0.0 if end == NEXT_TO_ZERO else end, where)
        found[name] = np.maximum(value, limit)
        if kind == 0:
            found["sensitivity_frequency"] = np.where(value > limit, where, np.inf)
    return found | {"disk_margin": 2.0 / found["disk_margin"]}


def _sensitivity(pair: _Pair, kind: int) -> Floats:
    """Return σ_max of S, T or S - T."""
    control, plant = pair
    return gain(over((plant, control, plant - control)[kind], plant + control))


def _gain_margins(response: Response, rows: Array, grid: Floats, on_grid: _Pair) -> dict[str, Floats]:
    """Return the factors on L with which it comes to -1, from its crossings of the negative real axis."""

    def curve(omega: Floats, members: Array) -> Floats:
        return _sine(response(omega, rows[members]))

    everyone = np.arange(rows.size)
    members, omega = roots(curve, grid, _sine(on_grid))
    for end in response.ends:
        real = everyone[np.abs(curve(np.full((1, 1), end), everyone)[:, 0]) < _REAL]
        members, omega = np.concatenate([members, real]), np.concatenate([omega, np.full(real.size, end)])
    control, plant = (values[:, 0, 0, 0] for values in response(omega[:, None], rows[members]))
    negative = (control * plant.conj()).real <= 0.0
    with np.errstate(divide="ignore"):
        factors = np.abs(plant[negative]) / np.abs(control[negative])
    factors = np.where(factors < _VANISHING, 0.0, np.where(factors > 1.0 / _VANISHING, np.inf, factors))
    members = members[negative]
    above, below = np.full(rows.size, np.inf), np.zeros(rows.size)
    np.minimum.at(above, members[factors > 1.0], factors[factors > 1.0])
    np.maximum.at(below, members[factors < 1.0], factors[factors < 1.0])
    return {"gain_margin": above, "gain_reduction": below}


def _phase_margins(response: Response, rows: Array, grid: Floats, on_grid: _Pair) -> dict[str, Floats]:
    """Return the least phase and the least delay with which L comes to -1, from the crossings of |L| = 1."""

    def curve(omega: Floats, members: Array) -> Floats:
        return _logarithm(response(omega, rows[members]))

    members, omega = roots(curve, grid, _logarithm(on_grid))
    control, plant = (values[:, 0, 0, 0] for values in response(omega[:, None], rows[members]))
    phase = np.angle(-control * plant.conj())
    margin, delay, crossover = (np.full(rows.size, value) for value in (np.inf, np.inf, np.nan))
    np.minimum.at(margin, members, np.abs(phase))
    np.minimum.at(delay, members, np.mod(phase, 2.0 * np.pi) / omega)
    worst = np.abs(phase) == margin[members]
    crossover[members[worst]] = omega[worst]
    return {"phase_margin_deg": np.degrees(margin), "crossover": crossover, "delay_margin": delay}


def _sine(pair: _Pair) -> Floats:
    """Return the sine of the phase of L, 0 where L is 0 or infinite, (n, k)."""
    control, plant = (values[..., 0, 0] for values in pair)
    size = np.abs(control) * np.abs(plant)
    sine: Floats = np.divide((control * plant.conj()).imag, size, out=np.zeros(size.shape), where=size > 0.0)
    return sine


def _logarithm(pair: _Pair) -> Floats:
    """Return log |L|, (n, k)."""
    control, plant = (values[..., 0, 0] for values in pair)
    with np.errstate(divide="ignore"):
        logarithm: Floats = np.log(np.abs(control)) - np.log(np.abs(plant))
    return logarithm


def gain(matrix: Complexes) -> Floats:
    """Return σ_max of matrices (…, m, m)."""
    size = matrix.shape[-1]
    if size == 1:
        absolute: Floats = np.abs(matrix[..., 0, 0])
        return absolute
    if size == 2:
        half = 0.5 * (np.abs(matrix) ** 2).sum(axis=(-2, -1))
        product = np.abs(matrix[..., 0, 0] * matrix[..., 1, 1] - matrix[..., 0, 1] * matrix[..., 1, 0])
        root: Floats = np.sqrt(half + np.sqrt(np.maximum(half**2 - product**2, 0.0)))
        return root
    norm: Floats = np.linalg.norm(matrix, 2, axis=(-2, -1))
    return norm


def _db(factor: Any) -> Any:
    with np.errstate(divide="ignore"):
        return 20.0 * np.log10(factor)
