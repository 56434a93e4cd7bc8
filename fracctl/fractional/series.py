"""The solution of a linear fractional system near t = 0, as a sum of powers.

With y = y(0) + Σ_e c_e t^e / Γ(e + 1) the equation Σ_j A_j D^{β_j} y = 0 is a recursion: D^β shifts e to e - β, so
each coefficient feeds those at e + ℓ_i - β, ℓ_i the highest order of coordinate i.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import rgamma

from fracctl.arrays import Array, Floats
from fracctl.compiling import compiled_with
from fracctl.errors import UnsupportedError
from fracctl.fractional.system import LinearFractionalSystem

_MOST_LEVELS = 60
"""Steps of the recursion after which the powers of a solution count as too dense."""
_Key = tuple[int, tuple[int, ...]]
"""Start (0 for y(0), 1 for y'(0)) and how often each symbol occurs."""


@dataclass(frozen=True)
class PowerSeries:
    """y_k = Σ_e c_e t^e / Γ(e + 1) up to an exponent, for a batch."""

    exponents: Floats
    """e, (E,), or (E, b) where members have orders of their own; the first two are 0 and 1."""
    coefficients: Floats
    """c_e, (E, p, …, b)."""
    remainder: Floats
    """Largest |c_e| / Γ(e + 1) of the first omitted exponents, (…, b)."""
    cut: float
    """Smallest omitted exponent."""

    def derivative(self, component: int, order: float | Floats, times: Floats) -> Floats:
        """Return the Caputo derivative (or the integral, order < 0) of y_k at times (t,), shape (…, b, t).

        `order` is a number or (b,). Powers that the Caputo derivative takes to zero are left out.
        """
        basis = differentiated(self.exponents, np.asarray(order, dtype=np.float64), times)
        values = self.coefficients[:, component]
        each: Floats
        if basis.ndim == 2:
            each = np.tensordot(values, basis, axes=(0, 0))
        else:
            each = np.einsum("e...b,ebt->...bt", values, basis)
        return each


def differentiated(exponents: Floats, order: Floats, times: Floats) -> Floats:
    """Return D^order of t^e / Γ(e + 1) at times (t,), (E, t), or (E, b, t) if exponents are (E, b) or order is (b,).

    The first two exponents are 0 and 1; the Caputo derivative of orders above them is zero.
    """
    own = exponents[:, None] if exponents.ndim == 1 and order.ndim else exponents
    powers = (own - order)[..., None]
    first = 2 if np.min(order) > 1.0 else 1 if np.min(order) > 0.0 else 0
    basis = np.zeros((*powers.shape[:-1], len(times)))
    basis[first:] = times ** powers[first:] * rgamma(powers[first:] + 1.0)
    return basis


def _killed(key: _Key, order: Floats) -> bool:
    """Whether the Caputo derivative takes the power to zero: y(0) for order > 0, y'(0) t for order > 1."""
    start, counts = key
    return not any(counts) and bool(np.min(order) > start)


def short_time_series(system: LinearFractionalSystem, y0: Floats, y0_rate: Floats, highest: float) -> PowerSeries:
    """Return the powers up to exponent `highest` of the solution with y(0), y'(0), each (…, b, p).

    Raises:
        UnsupportedError: an order lies so near the highest of its equation that the powers are too dense.
    """
    recipe, gains = recursion(system, y0, y0_rate, highest)
    lead = y0.shape[:-1]
    coefficients = np.zeros((len(recipe.exponents), system.size, int(np.prod(lead[:-1])), lead[-1]))
    for start, values in enumerate((y0, y0_rate)):
        coefficients[start] = np.moveaxis(values, -1, 0).reshape(coefficients.shape[1:])
    _apply(recipe.steps, gains, coefficients)
    coefficients = coefficients.reshape(-1, system.size, *lead)
    omitted = np.abs(coefficients[recipe.kept :]).max(axis=1, initial=0.0)
    remainder = np.max(omitted * recipe.sizes.reshape(-1, *[1] * len(lead)), axis=0, initial=0.0)
    return PowerSeries(recipe.exponents[: recipe.kept], coefficients[: recipe.kept], remainder, recipe.cut)


def recursion(system: LinearFractionalSystem, y0: Floats, y0_rate: Floats, highest: float) -> tuple[Recipe, Floats]:
    """Return the recipe of the coefficients of `short_time_series`, and its gains (entries, b)."""
    symbols = _symbols(system)
    present = [{i for i in range(system.size) if np.any(values[..., i])} for values in (y0, y0_rate)]
    entries = [entry for symbol in symbols for entry in symbol.entries.values()] or [np.zeros(())]
    gains = np.stack([np.broadcast_to(entry, y0.shape[-2:-1]) for entry in entries])
    return _cached_recipe(symbols, present, highest), gains


@dataclass(frozen=True, eq=False)
class Recipe:
    """Which coefficient feeds which."""

    exponents: Floats
    """(E,) or (E, b): 0 and 1 first, those beyond the highest last."""
    kept: int
    """Number of the others."""
    steps: Array
    """(target, source, row, column, entry): the target in the row of y gets -gain times the source in the column."""
    highest: float

    @cached_property
    def sizes(self) -> Floats:
        """1 / Γ(e + 1) of the omitted powers."""
        sizes: Floats = rgamma(self._omitted + 1.0)
        return sizes

    @cached_property
    def cut(self) -> float:
        """Smallest omitted exponent."""
        return float(self._omitted.min()) if self._omitted.size else self.highest + 1.0

    @property
    def _omitted(self) -> Floats:
        rest = self.exponents[self.kept :]
        least: Floats = np.array([exponent.min() for exponent in rest])
        return least

    @classmethod
    def ordered(cls, exponents: Floats, steps: Array, highest: float) -> Recipe:
        """Return the recipe with the exponents beyond the highest moved to the end."""
        beyond = exponents.reshape(len(exponents), -1).min(axis=1) > highest
        order = np.argsort(beyond, kind="stable")
        steps[:, :2] = np.argsort(order)[steps[:, :2]]
        return cls(exponents[order], int(np.sum(~beyond)), steps, highest)


def _cached_recipe(symbols: list[_Symbol], present: list[set[int]], highest: float) -> Recipe:
    if any(symbol.shift.ndim for symbol in symbols):
        return _recipe(symbols, present, highest)
    structure = tuple((float(s.shift), float(s.order), tuple(s.entries)) for s in symbols)
    return _shared_recipe(structure, tuple(frozenset(p) for p in present), highest)


@lru_cache(maxsize=256)
def _shared_recipe(
    structure: tuple[tuple[float, float, tuple[tuple[int, int], ...]], ...],
    present: tuple[frozenset[int], ...],
    highest: float,
) -> Recipe:
    """Return the recipe of members that share their orders."""
    blank = np.zeros(())
    symbols = [_Symbol(np.asarray(s), np.asarray(o), dict.fromkeys(places, blank)) for s, o, places in structure]
    return _recipe(symbols, [set(p) for p in present], highest)


def _recipe(symbols: list[_Symbol], present: list[set[int]], highest: float) -> Recipe:
    """Follow the recursion level by level; coefficients beyond `highest` are fed but feed no others.

    `present` tells which components of y(0) and of y'(0) are not zero.
    """
    places = [(number, place) for number, symbol in enumerate(symbols) for place in symbol.entries]
    keys: list[_Key] = [(start, (0,) * len(symbols)) for start in (0, 1)]
    index = {key: i for i, key in enumerate(keys)}
    exponents = [_exponent(key, symbols) for key in keys]
    present = list(present)
    steps: list[tuple[int, int, int, int, int]] = []
    level = keys
    for _ in range(_MOST_LEVELS):
        following: list[_Key] = []
        for key in level:
            source = index[key]
            if np.min(exponents[source]) > highest:
                continue
            for entry, (number, (row, column)) in enumerate(places):
                if column not in present[source] or _killed(key, symbols[number].order):
                    continue
                new = _extended(key, number)
                if new not in index:
                    index[new] = len(index)
                    exponents.append(_exponent(new, symbols))
                    present.append(set())
                    following.append(new)
                present[index[new]].add(row)
                steps.append((index[new], source, row, column, entry))
        level = following
        if not level:
            table = np.stack(np.broadcast_arrays(*exponents))
            return Recipe.ordered(table, np.array(steps, dtype=np.int64).reshape(-1, 5), highest)
    raise UnsupportedError(
        "an order of the loop lies too near the highest order of its equation, so that the powers of its"
        " short-time solution are too dense; lower the order or drop the term"
    )


@compiled_with()
def _apply(steps: Array, gains: Floats, coefficients: Floats) -> None:
    """Run the recursion on coefficients (E, p, k, b) with gains (entries, b), in place."""
    _, _, k, b = coefficients.shape
    for step in range(len(steps)):
        target, source, row, column, entry = steps[step]
        for i in range(k):
            for j in range(b):
                coefficients[target, row, i, j] -= gains[entry, j] * coefficients[source, column, i, j]


@dataclass(frozen=True)
class _Symbol:
    """All entries of the terms that shift exponents alike: same order, same ℓ_i - β."""

    shift: Floats
    order: Floats
    entries: dict[tuple[int, int], Floats]


def _symbols(system: LinearFractionalSystem) -> list[_Symbol]:
    highest = system.highest
    symbols: list[_Symbol] = []
    for term in system.dynamics[1:]:
        for row, column in np.argwhere(term.matrix.reshape(-1, *term.matrix.shape[-2:]).any(axis=0)):
            order = term.orders[..., column]
            shift = highest[row] - order
            same = [s for s in symbols if np.array_equal(s.shift, shift) and np.array_equal(s.order, order)]
            symbol = same[0] if same else _Symbol(shift, order, {})
            if not same:
                symbols.append(symbol)
            place = (int(row), int(column))
            symbol.entries[place] = symbol.entries.get(place, np.zeros(())) + term.matrix[..., row, column]
    return symbols


def _exponent(key: _Key, symbols: list[_Symbol]) -> Floats:
    start, counts = key
    total = np.asarray(float(start))
    for count, symbol in zip(counts, symbols, strict=True):
        if count:
            total = total + count * symbol.shift
    return total


def _extended(key: _Key, symbol: int) -> _Key:
    start, counts = key
    return start, (*counts[:symbol], counts[symbol] + 1, *counts[symbol + 1 :])
