"""How long a memory, how many filters: chosen from a tolerance on the frequency response."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Literal

import numpy as np

from fracctl.arrays import Complexes, Floats
from fracctl.controllers.linear import LinearLawTerms
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.sampled.exponentials import Exponentials
from fracctl.sampled.operators import Memory, SampledOperator
from fracctl.sampled.oustaloup import Oustaloup
from fracctl.sampled.window import MOST_SAMPLES, Window, grunwald_letnikov_weights
from fracctl.stability.margins import margins

Kind = Literal["window", "oustaloup", "exponentials"]
Band = tuple[float, float]
_POINTS = 81
_MOST_POLES = 60
_DECADE = 10.0
_REACHES = tuple(10.0 ** (0.25 * k) for k in range(25))
"""How far beyond the band filters and modes may reach, in both directions."""
_KERNELS = (0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-8)


def loop_band(loop: ClosedLoop) -> Band:
    """Return the band that matters to a loop: a decade to both sides of where |L| = 1 with the least phase margin.

    With several controls, of the frequency where the sensitivity has its peak.

    Raises:
        UnsupportedError: the loop is not stable, or has no such frequency.
    """
    found = margins(loop)
    centre = found.crossover if loop.plant.n_controls == 1 else found.sensitivity_frequency
    if not (found.stable is True and math.isfinite(centre) and centre > 0.0):
        raise UnsupportedError("the loop has no frequency around which a band can be laid; give a band or a memory")
    return centre / _DECADE, centre * _DECADE


def response_error(memory: Memory, order: float, period: float, band: Band) -> float:
    """Return the largest relative error of a memory's D^order (I^-order if negative) in a band.

        max |G(ω)/G_0(ω) - 1|,        ω_1 ≤ ω ≤ ω_2

    G_0 is the operator with the whole past: ((1 - e^{-iωh})/h)^order for a window, (iω)^order on lines between samples
    for the others. It is late itself by a share of the period where positions are differentiated, which no length of
    memory changes.

    Args:
        memory: the memory.
        order: in (-1, 1), not 0.
        period: h.
        band: ω_1 and ω_2 in rad per unit of time; beyond the Nyquist frequency π/h nothing is looked at.

    Raises:
        ArgumentError: the band is empty.
    """
    omega = _grid(band, period)
    if isinstance(memory, Window):
        return _window_error(memory.samples, order, omega * period)
    if isinstance(memory, Oustaloup):
        found, whole = memory.response(order, omega), (1j * omega) ** order
    else:
        found = _operator(memory, order, period).response(omega * period)
        whole = _whole_past(order, period, float(omega[0]), len(omega), float(omega[-1]))
    return float(np.abs(found / whole - 1.0).max())


def choose_memory(kind: Kind, orders: Sequence[float], period: float, band: Band, tolerance: float) -> Memory:
    """Return the memory of a kind with the fewest states that keeps a tolerance for all orders.

    Args:
        kind: ``window``, ``oustaloup`` or ``exponentials``.
        orders: of derivatives in (0, 1) and of integrals in (-1, 0), see `memory_orders`; not empty.
        period: h.
        band: in which `response_error` is kept below the tolerance, see `loop_band`.
        tolerance: in (0, 1).

    Raises:
        ArgumentError: the kind is unknown, an argument lies outside its range, or no memory keeps the tolerance.
    """
    if kind not in ("window", "oustaloup", "exponentials"):
        raise ArgumentError("kind", repr(kind), "must be 'window', 'oustaloup' or 'exponentials'")
    if not 0.0 < tolerance < 1.0:
        raise ArgumentError("tolerance", tolerance, "must lie in (0, 1)")
    if not orders or not all(0.0 < abs(order) < 1.0 for order in orders):
        raise ArgumentError("orders", list(orders), "must be orders in (-1, 1) other than 0")
    _grid(band, period)
    candidates = {"window": _windows, "oustaloup": _filters, "exponentials": _modes}[kind]
    for memory in candidates(orders, period, band, tolerance):
        if max(response_error(memory, order, period, band) for order in orders) <= tolerance:
            return memory
    reached = f"is below what a memory of kind '{kind}' reaches in this band"
    if kind != "window":
        raise ArgumentError("tolerance", tolerance, reached)
    cure = "allow more, or take another kind"
    raise ArgumentError("tolerance", tolerance, f"{reached} with {MOST_SAMPLES} samples", cure)


def memory_for(loop: ClosedLoop, kind: Kind, period: float, tolerance: float, feed: str = "position") -> Memory:
    """Return the memory that a loop's law needs, chosen in `loop_band`; of a law without fractional orders any.

    Args:
        loop: of a linear plant and a single linear law.
        kind: as for `choose_memory`.
        period: h.
        tolerance: as for `choose_memory`.
        feed: of the sampled law, ``position`` or ``velocity``.

    Raises:
        ArgumentError: as for `choose_memory`.
        UnsupportedError: as for `loop_band`.
    """
    orders = memory_orders(loop.law_terms, feed)
    return choose_memory(kind, orders, period, loop_band(loop), tolerance) if orders else Window(2)


def memory_orders(terms: LinearLawTerms, feed: str = "position") -> list[float]:
    """Return the orders of the fractional operators that a law needs, each once; negative ones are integrals.

    Args:
        terms: of the law.
        feed: with ``velocity`` D^α ξ is I^(1-α) ξ'.
    """
    found = set()
    for term in terms.control:
        used = term.orders[..., np.any(term.matrix, axis=tuple(range(term.matrix.ndim - 1)))]
        found |= {float(order) for order in used.ravel() if 0.0 < abs(order) < 1.0}
    return sorted(order - 1.0 if feed == "velocity" and order > 0.0 else order for order in found)


def _grid(band: Band, period: float) -> Floats:
    low, high = band[0], min(band[1], np.pi / period)
    if not 0.0 < low < high:
        raise ArgumentError("band", band, "must be two growing positive frequencies below the Nyquist frequency")
    return np.logspace(np.log10(low), np.log10(high), _POINTS)


def _operator(memory: Memory, order: float, period: float) -> SampledOperator:
    return memory.derivative(order, period) if order > 0.0 else memory.integral(-order, period)


@lru_cache(maxsize=32)
def _whole_past(order: float, period: float, low: float, count: int, high: float) -> Complexes:
    """Return the response of lines between samples with modes that reach far beyond the band."""
    omega = np.logspace(np.log10(low), np.log10(high), count)
    return _operator(Exponentials(1e6 / low, 1e-10), order, period).response(omega * period)


def _window_error(samples: int, order: float, phase: Floats) -> float:
    weights = grunwald_letnikov_weights(order, samples)
    if order > 0.0:
        weights[-1] -= weights.sum()
    backward = np.exp(-1j * phase)
    found = np.polynomial.polynomial.polyval(backward, weights)
    return float(np.abs(found / (1.0 - backward) ** order - 1.0).max())


def _windows(orders: Sequence[float], period: float, band: Band, tolerance: float) -> Iterator[Memory]:
    """Yield the shortest window that keeps the tolerance, by doubling and bisection."""

    def fails(samples: int) -> bool:
        return max(response_error(Window(samples), order, period, band) for order in orders) > tolerance

    low, high = 1, 2
    while fails(high):
        if high == MOST_SAMPLES:
            return
        low, high = high, min(2 * high, MOST_SAMPLES)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if fails(middle) else (low, middle)
    yield Window(high)


def _filters(orders: Sequence[float], period: float, band: Band, tolerance: float) -> Iterator[Memory]:
    del orders, period, tolerance
    for count in range(1, _MOST_POLES + 1):
        yield from (Oustaloup(band[0] / reach, band[1] * reach, count) for reach in _REACHES)


def _modes(orders: Sequence[float], period: float, band: Band, tolerance: float) -> Iterator[Memory]:
    del tolerance
    every = [Exponentials(reach / band[0], kernel) for reach in _REACHES for kernel in _KERNELS]
    return iter(sorted(every, key=lambda memory: len(_operator(memory, orders[0], period).b)))
