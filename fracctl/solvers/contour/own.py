"""The same tables as `contour_tables` for members with orders of their own, in blocks of members.

σ^e is an entire function of e: piece by piece of the range of orders it is a Chebyshev series in e, whose coefficients
at all nodes are kept for the next batch. A table is a product with the polynomials of the members.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import rgamma

from fracctl.arrays import Array, Floats
from fracctl.fractional.terms import powers
from fracctl.solvers.contour.lanes import LANES, lanes
from fracctl.solvers.contour.plan import Plan, last_coefficients

_PIECE = 0.25
"""Length of the pieces: few terms, and over each of them σ^e changes so little that no digits are lost."""
_ROUNDING = 1e-17


def own(orders: list[Floats], members: Array) -> Floats:
    """Return orders, each () or (b,), of some members as blocks, (blocks, number, LANES)."""
    chosen = [order[members] if order.ndim else np.full(len(members), order) for order in orders]
    return lanes(np.stack(chosen), np.arange(len(members)))


def own_powers(plan: Plan, orders: list[Floats], members: Array) -> Floats:
    """Return σ^e along the path, (blocks, P, C, 2, LANES)."""
    exponents = own(orders, members)
    table = np.empty((len(exponents), len(plan.path), len(orders), 2, LANES))
    for column, order in enumerate(orders):
        if order.ndim == 0:
            value = powers(plan.path, order)
            table[:, :, column, 0], table[:, :, column, 1] = value.real[:, None], value.imag[:, None]
            continue
        table[:, :, column] = _series_of(plan, exponents[:, column]).reshape(len(exponents), -1, 2, LANES)
    return table


def _series_of(plan: Plan, exponents: Floats) -> Floats:
    """Return real and imaginary parts of σ^e along the path for exponents (blocks, LANES), (blocks, 2P, LANES)."""
    pieces = np.ceil(exponents / _PIECE)
    series, polynomials = [], []
    for piece in np.unique(pieces):
        series.append(_series(plan, float(piece)))
        values = _polynomials(2.0 * (exponents / _PIECE - piece) + 1.0, series[-1].shape[1])
        polynomials.append(np.where((pieces == piece)[:, None], values, 0.0))
    product: Floats = np.concatenate(series, axis=1) @ np.concatenate(polynomials, axis=1)
    return product


@lru_cache(maxsize=256)
def _series(plan: Plan, piece: float) -> Floats:
    """Return Chebyshev coefficients of real and imaginary parts of σ^e for e on one piece, (2P, K).

    With z = |log σ| times half its length they fall like (z / 2)^k / k!.
    """
    z = 0.5 * _PIECE * np.abs(np.log(plan.path)).max()
    terms = np.cumprod(0.5 * z / np.arange(1, 80)) * np.exp(z)
    count = 2 + int(np.sum(terms > _ROUNDING))
    angles = np.pi * (np.arange(count) + 0.5) / count
    values = powers(plan.path, _PIECE * (piece - 0.5 + 0.5 * np.cos(angles)))
    weights = (2.0 / count) * np.cos(np.arange(count)[:, None] * angles)
    weights[0] *= 0.5
    coefficients = (weights @ values).T
    return np.stack([coefficients.real, coefficients.imag], axis=1).reshape(-1, count)


def _polynomials(x: Floats, count: int) -> Floats:
    """Return T_k(x) for x (blocks, LANES), (blocks, K, LANES)."""
    values = np.empty((len(x), count, LANES))
    values[:, 0], values[:, 1] = 1.0, x
    for k in range(2, count):
        values[:, k] = 2.0 * x * values[:, k - 1] - values[:, k - 2]
    return values


def own_shapes(plan: Plan, exponents: Floats) -> Floats:
    """Return rows of t^p / Γ(p + 1) on all windows for exponents (blocks, w, LANES), (blocks, w, rows, LANES)."""
    blocks, count, _ = exponents.shape
    shapes = np.empty((blocks, count, sum(window.rows for window in plan.windows), LANES))
    for w in range(count):
        p = exponents[:, w, None]
        first = 0
        for window in plan.windows:
            middle, end = first + len(window.times), first + window.rows
            if p.any():
                shapes[:, w, first:middle] = np.exp(p * np.log(window.times)[:, None]) * rgamma(p + 1.0)
            else:
                shapes[:, w, first:middle] = 1.0
            shapes[:, w, middle:end] = window.last @ shapes[:, w, first:middle]
            first = end
    return shapes


def own_start(plan: Plan, exponents: Floats, orders: Floats) -> Floats:
    """Return the matrices from powers (blocks, E, LANES) to rows of derivatives (blocks, w, LANES) on the first panel.

    They are (blocks, w, rows, E, LANES); the last row is the value at 0+. The first two exponents are 0 and 1; the
    Caputo derivative of orders above them is zero.
    """
    nodes, (blocks, count, _) = plan.grid.panels[0].nodes, exponents.shape
    last, times = last_coefficients(plan.grid, slice(0, nodes)), np.log(plan.grid.times[:nodes])[:, None]
    values = np.exp(times[..., None] * exponents[:, None])
    matrices = np.empty((blocks, orders.shape[1], nodes + len(last) + 1, count, LANES))
    for w in range(orders.shape[1]):
        order, matrix = orders[:, w], matrices[:, w]
        shifted = exponents - order[:, None]
        factors = rgamma(shifted + 1.0)
        factors[:, : 2 if order.min() > 1.0 else 1 if order.min() > 0.0 else 0] = 0.0
        if order.any():
            np.multiply(values, np.exp(-times * order[:, None])[:, :, None], out=matrix[:, :nodes])
            matrix[:, :nodes] *= factors[:, None]
        else:
            np.multiply(values, factors[:, None], out=matrix[:, :nodes])
        rows = matrix[:, :nodes].reshape(blocks, nodes, -1)
        matrix[:, nodes:-1] = (last @ rows).reshape(blocks, len(last), count, LANES)
        matrix[:, -1] = np.where(shifted == 0.0, factors, 0.0)
        matrix[:, -1][(shifted < 0.0) & (factors != 0.0)] = np.inf
    return matrices
