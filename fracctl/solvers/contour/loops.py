"""A batch of linear fractional loops as the contour engine takes it: coefficients with members last, powers apart.

With y = y(0) + z the transform Z of z solves M(σ) Z = r(σ), and M̃ Z̃ = r for Z̃ = σ^ℓ Z. What is wanted are
derivatives D^γ y; those of one coordinate with orders that all members share come from one transform.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.fractional.series import Recipe, recursion
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.solvers.contour.engine import Wanted
from fracctl.solvers.contour.fill import TERMS, Matrix, Sums

_Power = tuple[Floats, Floats]
"""Coefficient (…, b) or less, and exponent, () or (b,)."""


@dataclass(frozen=True)
class Derivative:
    """D^order of one coordinate, to be computed; `order` is () or (b,)."""

    component: int
    order: Floats

    def same(self, other: Derivative) -> bool:
        """Whether two are the same."""
        return self.component == other.component and np.array_equal(self.order, other.order)


@dataclass(frozen=True, eq=False)
class Loops:
    """Loops with their initial values and the derivatives that are wanted of them."""

    matrix: Matrix
    exponents: list[Floats]
    """Of the table of powers, each () or (b,)."""
    entries: Floats
    """Coefficients of M̃, (t, b)."""
    sources: Floats
    """Coefficients of r, (k, t', b)."""
    derivatives: list[Derivative]
    wanted: Wanted
    kernels: tuple[tuple[float, ...], ...]
    """Exponents of the kernels of each request."""
    gains: Floats
    """υ_i = Σ_u gains[i, u] values[used[u]], (m, u, b)."""
    added: Floats
    """What D^γ y has besides σ^γ Z is c t^p / Γ(p + 1): c, (w, k, b)."""
    powers: list[Floats]
    """p, each () or (b,)."""
    recipe: Recipe
    feeds: Floats
    """Gains of the recipe, (entries, b)."""
    initial: Floats
    """y(0) and y'(0), (2, p, k, b)."""
    sizes: tuple[int, int]
    """m positions and q auxiliary states."""

    @cached_property
    def shared(self) -> bool:
        """Whether all members have the same orders."""
        orders = [*self.exponents, *self.powers, *(wanted.order for wanted in self.derivatives)]
        return self.recipe.exponents.ndim == 1 and not any(order.ndim for order in orders)


def loops(system: LinearFractionalSystem, y0: Floats, y0_rate: Floats, with_rates: bool, series_order: float) -> Loops:
    """Return the loops of a system from y(0), y'(0), each (k, b, p) or (k, 1, p)."""
    b, m, p = system.batch or 1, system.n_positions, system.size
    y0, y0_rate = (np.broadcast_to(v, (len(v), b, p)) for v in (y0, y0_rate))
    matrix = CharacteristicMatrix(system)
    parts = [matrix.split(block) for block in matrix.blocks()]
    coordinates = [i for kept, gone in parts for i in kept + gone]
    simple = all(len(kept) < 3 and not gone for kept, gone in parts)
    exponents: list[Floats] = []
    places = [place for kept, gone in parts for place in _entries(kept, gone)]
    entries, coefficients = _sums([_entry(matrix, i, j) for i, j in places], exponents, (b,))
    sources, source_coefficients = _sums(
        [_source(system, i, y0, y0_rate) for i in coordinates], exponents, y0.shape[:2]
    )
    derivatives, used, gains = _derivatives(system, with_rates)
    highest = [float(order) for order in system.highest]
    requests, kernels = _requests(derivatives, highest, exponents)
    added = [_initial_value(wanted, y0, y0_rate) for wanted in derivatives]
    recipe, feeds = recursion(system, y0, y0_rate, series_order)

    def place(component: int, order: float) -> int:
        return next(i for i, w in enumerate(derivatives) if w.same(Derivative(component, np.asarray(order))))

    stored = [place(i, 0.0) for i in range(p)] + ([place(i, 1.0) for i in range(m)] if with_rates else [])
    return Loops(
        Matrix(_blocks(parts), np.array(coordinates), entries, sources, None if simple else entries.edges),
        exponents,
        coefficients,
        np.moveaxis(source_coefficients, 0, 1),
        derivatives,
        Wanted(
            np.array([wanted.component for wanted in derivatives]),
            requests,
            np.array(stored),
            used,
        ),
        kernels,
        gains,
        np.stack([coefficient for coefficient, _ in added]),
        [power for _, power in added],
        recipe,
        feeds,
        np.moveaxis(np.stack([y0, y0_rate]), -1, 1),
        (m, p - m),
    )


def _entries(kept: list[int], gone: list[int]) -> list[tuple[int, int]]:
    """Return rows and columns of the entries of a block, see `Matrix.entries`."""
    first = [(i, j) for i in kept for j in kept]
    return first + [place for k in gone for place in [*((i, k) for i in kept), *((k, j) for j in kept), (k, k)]]


def _blocks(parts: list[tuple[list[int], list[int]]]) -> Array:
    """Return the sizes of blocks, their first coordinates and first entries; see `Matrix.blocks`."""
    kept, gone = np.array([(len(kept), len(gone)) for kept, gone in parts]).T
    entries = kept**2 + gone * (2 * kept + 1)
    return np.stack([kept, gone, np.cumsum(kept + gone) - kept - gone, np.cumsum(entries) - entries], axis=1)


def _sums(parts: list[list[_Power]], exponents: list[Floats], shape: tuple[int, ...]) -> tuple[Sums, Floats]:
    """Return sums of powers and their coefficients (t, …); exponents that are new join `exponents`."""
    columns: list[int] = []
    coefficients: list[Floats] = []
    edges = [0]
    for part in parts:
        for coefficient, exponent in part:
            columns.append(_column(exponent, exponents))
            coefficients.append(np.broadcast_to(coefficient, shape))
        fill = -len(part) % TERMS
        columns += [0] * fill
        coefficients += [np.zeros(shape)] * fill
        edges.append(len(columns))
    values = np.stack(coefficients) if coefficients else np.zeros((0, *shape))
    return Sums(np.array(columns, dtype=np.int64), np.array(edges)), values


def _column(exponent: Floats, exponents: list[Floats]) -> int:
    for i, known in enumerate(exponents):
        if np.array_equal(known, exponent):
            return i
    exponents.append(np.asarray(exponent))
    return len(exponents) - 1


def _entry(matrix: CharacteristicMatrix, row: int, column: int) -> list[_Power]:
    entry = matrix.entries[row][column]
    if entry is None:
        return []
    return [(entry.coefficients[..., j], entry.exponents[..., j]) for j in range(entry.exponents.shape[-1])]


def _source(system: LinearFractionalSystem, row: int, y0: Floats, y0_rate: Floats) -> list[_Power]:
    """Return r_i = Σ_{β>1} A_j σ^(β-2) y'(0) - Σ_{β≤0} A_j σ^(β-1) y(0) with coefficients (k, b)."""
    powers: list[_Power] = []
    for term in system.dynamics:
        for column in np.flatnonzero(term.matrix[..., row, :].reshape(-1, system.size).any(axis=0)):
            order = term.orders[..., column]
            if np.all(order <= 0.0):
                coefficient, exponent = -term.matrix[..., row, column] * y0[..., column], order - 1.0
            elif np.all(order > 1.0):
                coefficient, exponent = term.matrix[..., row, column] * y0_rate[..., column], order - 2.0
            else:
                continue
            same = [i for i, (_, known) in enumerate(powers) if np.array_equal(known, exponent)]
            if same:
                powers[same[0]] = powers[same[0]][0] + coefficient, exponent
            elif np.any(coefficient):
                powers.append((coefficient, exponent))
    return powers


def _derivatives(system: LinearFractionalSystem, with_rates: bool) -> tuple[list[Derivative], Array, Floats]:
    """Return what is wanted, by coordinate and with shared orders first, and of the controls `used` and gains."""
    zero, one = np.zeros(()), np.ones(())
    wanted = [Derivative(i, zero) for i in range(system.size)]
    wanted += [Derivative(i, one) for i in range(system.n_positions)] if with_rates else []
    parts = [
        (Derivative(int(column), term.orders[..., column]), term.matrix[..., column])
        for term in system.control
        for column in np.flatnonzero(term.matrix.reshape(-1, system.size).any(axis=0))
    ]
    for derivative, _ in parts:
        if not any(derivative.same(known) for known in wanted):
            wanted.append(derivative)
    wanted.sort(key=lambda derivative: (derivative.component, derivative.order.ndim))
    places = [next(i for i, known in enumerate(wanted) if known.same(derivative)) for derivative, _ in parts]
    used = sorted(set(places)) or [0]
    gains = np.zeros((system.n_positions, len(used) + len(used) % 2, system.batch or 1))
    for place, (_, gain) in zip(places, parts, strict=True):
        gains[:, used.index(place)] += gain.T if gain.ndim == 2 else gain[:, None]
    return wanted, np.array(used + used[: len(used) % 2], dtype=np.intp), gains


def _requests(
    derivatives: list[Derivative], highest: list[float], exponents: list[Floats]
) -> tuple[Array, tuple[tuple[float, ...], ...]]:
    """Return which derivatives share a transform, see `Wanted.requests`, and the exponents of their kernels."""
    requests: list[tuple[int, int, int, int]] = []
    kernels: list[tuple[float, ...]] = []
    for component, top in enumerate(highest):
        mine = [i for i, wanted in enumerate(derivatives) if wanted.component == component]
        shared = [i for i in mine if not derivatives[i].order.ndim]
        requests.append((component, shared[0], len(shared), -1))
        kernels.append(tuple(float(derivatives[i].order) - top for i in shared))
        for i in mine[len(shared) :]:
            requests.append((component, i, 1, _column(derivatives[i].order - top, exponents)))
            kernels.append((0.0,))
    return np.array(requests), tuple(kernels)


def _initial_value(wanted: Derivative, y0: Floats, y0_rate: Floats) -> _Power:
    """Return what D^γ y has besides σ^γ Z, as c t^p / Γ(p + 1): c (k, b) and p.

    D^γ of y(0) for γ ≤ 0; minus the power that σ^γ Z has too much of for 1 < γ; nothing between.
    """
    order, column = wanted.order, wanted.component
    if np.all(order <= 0.0):
        return y0[..., column], -order
    if np.all(order > 1.0):
        return -y0_rate[..., column], 1.0 - order
    return np.zeros(y0.shape[:-1]), np.zeros(())
