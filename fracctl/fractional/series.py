"""The solution of a linear fractional system near t = 0, as a sum of powers.

With y = y(0) + Σ_e c_e t^e / Γ(e + 1) the equation Σ_j A_j D^{β_j} y = 0 is a recursion: D^β shifts e to e - β, so
each coefficient feeds those at e + ℓ_i - β, ℓ_i the highest order of coordinate i.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.special import rgamma

from fracctl.arrays import Floats
from fracctl.errors import UnsupportedError
from fracctl.fractional.system import LinearFractionalSystem

_MOST_LEVELS = 60
"""Steps of the recursion after which the powers of a solution count as too dense."""
_Key = tuple[int, tuple[tuple[int, int], ...]]
"""Start (0 for y(0), 1 for y'(0)) and how often each (term, column-row shift class) occurs."""


@dataclass(frozen=True)
class PowerSeries:
    """y_k = Σ_e c_e t^e / Γ(e + 1) up to an exponent, for a batch."""

    exponents: list[Floats]
    """e, each () or (b, 1)."""
    coefficients: list[Floats]
    """c_e, each (p, …, b)."""
    remainder: Floats
    """Largest |c_e| / Γ(e + 1) of the first omitted exponents, (…, b)."""
    cut: float
    """Smallest omitted exponent."""

    def derivative(self, component: int, order: float | Floats, times: Floats) -> Floats:
        """Return the Caputo derivative (or the integral, order < 0) of y_k at times (t,), shape (…, b, t).

        `order` is a number or (b,). Powers that the Caputo derivative takes to zero are left out.
        """
        kept = [
            (e, c[component])
            for e, c in zip(self.exponents, self.coefficients, strict=True)
            if not _killed(e, order) and np.any(c[component])
        ]
        lead = self.coefficients[0].shape[1:]
        if not kept:
            return np.zeros((*lead, len(times)))
        values = np.stack([c for _, c in kept], axis=-1)
        shift = np.asarray(order, dtype=np.float64)[..., None]
        powers = np.stack(np.broadcast_arrays(*[np.atleast_1d(e) - shift for e, _ in kept]), axis=-2)
        basis = times**powers * rgamma(powers + 1.0)
        if basis.ndim == 2:
            total: Floats = values @ basis
            return total
        each: Floats = np.einsum("...be,bet->...bt", values, basis)
        return each


def _killed(exponent: Floats, order: float | Floats) -> bool:
    """Whether the Caputo derivative takes t^e to zero: 1 for order > 0, t for order > 1."""
    if exponent.ndim:
        return False
    smallest = np.min(order)
    return bool((exponent == 0.0 and smallest > 0.0) or (exponent == 1.0 and smallest > 1.0))


def short_time_series(system: LinearFractionalSystem, y0: Floats, y0_rate: Floats, highest: float) -> PowerSeries:
    """Return the powers up to exponent `highest` of the solution with y(0), y'(0), each (…, b, p).

    Raises:
        UnsupportedError: an order lies so near the highest of its equation that the powers are too dense.
    """
    symbols = _symbols(system)
    level: dict[_Key, Floats] = {(0, ()): np.moveaxis(y0, -1, 0), (1, ()): np.moveaxis(y0_rate, -1, 0)}
    exponents: list[Floats] = []
    coefficients: list[Floats] = []
    remainder, cut = np.zeros(y0.shape[:-1]), highest + 1.0
    for _ in range(_MOST_LEVELS):
        following: dict[_Key, Floats] = {}
        for key, value in level.items():
            e = _exponent(key, symbols)
            if np.min(e) > highest:
                remainder = np.maximum(remainder, np.abs(value).max(axis=0) * rgamma(float(np.min(e)) + 1.0))
                cut = min(cut, float(np.min(e)))
                continue
            exponents.append(e)
            coefficients.append(value)
            for number, symbol in enumerate(symbols):
                if not _killed(e, symbol.order):
                    symbol.feed(value, following, _extended(key, number))
        level = following
        if not level:
            break
    else:
        raise UnsupportedError(
            "an order of the loop lies too near the highest order of its equation, so that the powers of its"
            " short-time solution are too dense; lower the order or drop the term"
        )
    return PowerSeries(exponents, coefficients, remainder, cut)


@dataclass
class _Symbol:
    """All entries of the terms that shift exponents alike: same order, same ℓ_i - β."""

    shift: Floats
    order: Floats
    entries: dict[tuple[int, int], Floats]

    def feed(self, value: Floats, following: dict[_Key, Floats], key: _Key) -> None:
        """Add the contribution of coefficients `value` (p, …, b) to those of `key` in `following`."""
        for (row, column), entry in self.entries.items():
            if np.any(value[column]):
                if key not in following:
                    following[key] = np.zeros_like(value)
                following[key][row] -= entry * value[column]


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
    for number, count in counts:
        shift = symbols[number].shift
        total = total + count * (shift[:, None] if shift.ndim else shift)
    return total


def _extended(key: _Key, symbol: int) -> _Key:
    counts = Counter(dict(key[1]))
    counts[symbol] += 1
    return key[0], tuple(sorted(counts.items()))
