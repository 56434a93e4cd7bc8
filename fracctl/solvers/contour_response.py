"""Responses of a batch of linear fractional loops on the windows of a plan.

With y = y(0) + z the transform Z of z solves M(σ) Z = r(σ), and M̃ Z̃ = r for Z̃ = σ^ℓ Z. One fill of Z̃ at the
nodes of a window serves every derivative of every coordinate: D^γ z(t) is a real matrix product with the kernel of
σ^(γ - ℓ), in which no initial value cancels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import rgamma

from fracctl.arrays import Booleans, Complexes, Floats
from fracctl.characteristic import kernels
from fracctl.characteristic.matrix import CharacteristicMatrix, stack
from fracctl.characteristic.winding import crossings
from fracctl.fractional.series import short_time_series
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import powers
from fracctl.solvers.contour_kernels import controls_and_errors, place
from fracctl.solvers.contour_plan import Plan

SAFETY = 6.0
"""Estimate over the largest difference seen: the two rules and the times compared are few."""
Halves = tuple[Floats, Floats]
"""Z̃ at the odd and at the even nodes of all contours, (k, b, Σ 2N) and (k, b, Σ (2N + 2)), real parts first."""


@dataclass(frozen=True)
class Response:
    """Values of a group of members on the grid of a plan, from k initial states each."""

    positions: Floats
    """(k, b, m, T)."""
    rates: Floats | None
    """(k, b, m, T)."""
    auxiliary: Floats
    """(k, b, q, T)."""
    controls: Floats
    """(k, b, m, T)."""
    initial_controls: Floats
    """υ(0+), (k, b, m)."""
    error: Floats
    """Difference of the two quadrature rules, interpolation and series remainders over the peak, (k, b)."""
    enclosed: Booleans
    """Whether every contour has all poles on its left, (b,)."""


@dataclass(frozen=True)
class _Derivative:
    """D^order of one coordinate, to be computed; `order` is a number or (b,)."""

    component: int
    order: Floats


def respond(system: LinearFractionalSystem, y0: Floats, y0_rate: Floats, plan: Plan, with_rates: bool) -> Response:
    """Solve the members of `system` from y(0), y'(0), each (k, b, p) or (k, 1, p), on the grid of `plan`."""
    b, m, p = system.batch or 1, system.n_positions, system.size
    y0, y0_rate = (np.broadcast_to(v, (v.shape[0], b, p)) for v in (y0, y0_rate))
    orders = [_Derivative(i, np.zeros(())) for i in range(p)]
    orders += [_Derivative(i, np.ones(())) for i in range(m)] if with_rates else []
    places: list[tuple[int, int, int]] = []
    for j, term in enumerate(system.control):
        for column in range(p):
            if np.any(term.matrix[..., column]):
                wanted = _Derivative(column, term.orders[..., column])
                places.append((j, column, _index(orders, wanted)))
    values, differences, initial, enclosed = _derivatives(system, y0, y0_rate, plan, orders)
    gains = np.zeros((b, m, len(orders)))
    for j, column, where in places:
        gains[:, :, where] += system.control[j].matrix[..., column]
    controls, peaks, tails, worst = controls_and_errors(
        values, differences, gains, plan.grid.offsets, plan.grid.last, m
    )
    peaks[0] = np.maximum(peaks[0], np.abs(y0[..., :m]).max(axis=-1))
    errors = np.divide(SAFETY * np.maximum(tails, worst), peaks, out=np.zeros_like(peaks), where=peaks > 0.0)
    return Response(
        positions=np.moveaxis(values[:m], 0, 2),
        rates=np.moveaxis(values[p : p + m], 0, 2) if with_rates else None,
        auxiliary=np.moveaxis(values[m:p], 0, 2),
        controls=controls,
        initial_controls=np.einsum("bmw,wkb->kbm", gains, initial[..., 0]),
        error=errors.max(axis=0),
        enclosed=enclosed,
    )


def _index(orders: list[_Derivative], wanted: _Derivative) -> int:
    for i, known in enumerate(orders):
        if known.component == wanted.component and np.array_equal(known.order, wanted.order):
            return i
    orders.append(wanted)
    return len(orders) - 1


def _derivatives(
    system: LinearFractionalSystem, y0: Floats, y0_rate: Floats, plan: Plan, orders: list[_Derivative]
) -> tuple[Floats, Floats, Floats, Booleans]:
    """Return derivatives on the grid (w, k, b, T), differences (w, k, b, c), values at 0+ (w, k, b, 1), enclosure."""
    k, b, p = y0.shape
    values = np.empty((len(orders), k, b, len(plan.grid.times)))
    differences = np.empty((len(orders), k, b, len(plan.windows) + 1))
    initial = _start(system, y0, y0_rate, plan, orders, values, differences)
    transforms, enclosed = _transforms(CharacteristicMatrix(system), y0, y0_rate, plan)
    for component in range(p):
        wanted = [i for i, order in enumerate(orders) if order.component == component]
        for places, exponents, halves in _requests(system, plan, transforms[component], wanted, orders):
            added = [_initial_value(orders[i], y0, y0_rate) for i in places]
            _invert(plan, exponents, halves, places, added, values, differences)
    return values, differences, initial, enclosed


def _requests(
    system: LinearFractionalSystem, plan: Plan, halves: Halves, wanted: list[int], orders: list[_Derivative]
) -> Iterator[tuple[list[int], tuple[float, ...], Halves]]:
    """Yield derivatives of one coordinate that share a transform: all with shared orders, each of the others alone."""
    shared = [i for i in wanted if orders[i].order.ndim == 0]
    highest = float(system.highest[orders[wanted[0]].component])
    yield shared, tuple(float(orders[i].order) - highest for i in shared), halves
    for i in wanted:
        if orders[i].order.ndim:
            yield [i], (-highest,), _times_powers(plan, halves, orders[i].order)


def _invert(
    plan: Plan,
    exponents: tuple[float, ...],
    halves: Halves,
    places: list[int],
    added: list[tuple[Floats, Floats]],
    values: Floats,
    differences: Floats,
) -> None:
    """Fill in (σ^e Z)(t) on all windows and the largest difference from the other rule at the checked times."""
    odd, even = halves
    count, k, b = len(exponents), *odd.shape[:2]
    at = 0
    for number, (window, (middle, ends)) in enumerate(zip(plan.windows, plan.kernels(exponents), strict=True)):
        n = window.nodes
        main = (odd.reshape(k * b, -1)[:, at : at + 2 * n] @ middle).reshape(k, b, count, -1)
        start = at + 2 * number
        other = (even.reshape(k * b, -1)[:, start : start + 2 * n + 2] @ ends).reshape(k, b, count, -1)
        at += 2 * n
        for j, (i, (coefficient, power)) in enumerate(zip(places, added, strict=True)):
            shape = window.times ** power[:, None] * rgamma(power[:, None] + 1.0)
            out = values[i, :, :, window.where]
            place(
                main[:, :, j], other[:, :, j], window.checked, coefficient, shape, out, differences[i, :, :, number + 1]
            )


def _start(
    system: LinearFractionalSystem,
    y0: Floats,
    y0_rate: Floats,
    plan: Plan,
    orders: list[_Derivative],
    values: Floats,
    differences: Floats,
) -> Floats:
    """Fill the first panel from the power series, and one column with its remainder; return values at 0+."""
    panel = plan.grid.panels[0]
    times = plan.grid.times[: panel.nodes]
    series = short_time_series(system, y0, y0_rate, plan.series_order)
    initial = np.empty((*values.shape[:-1], 1))
    for i, wanted in enumerate(orders):
        values[i, :, :, : panel.nodes] = series.derivative(wanted.component, wanted.order, times)
        # the omitted power, differentiated: Γ(e + 1) / Γ(e - γ + 1) grows at most as e^γ
        order = np.maximum(wanted.order, 0.0)
        growth = panel.end ** (series.cut - order) * (series.cut + 1.0) ** order
        differences[i, :, :, 0] = series.remainder * growth
        initial[i] = series.derivative(wanted.component, wanted.order, np.zeros(1))
    return initial


def _transforms(matrix: CharacteristicMatrix, y0: Floats, y0_rate: Floats, plan: Plan) -> tuple[list[Halves], Booleans]:
    """Return Z̃ of each coordinate at odd and even nodes, and whether all contours enclose all poles, (b,)."""
    k, b, _ = y0.shape
    n, w = int(plan.layout[:, 1].sum()), len(plan.windows)
    enclosed = np.ones(b, dtype=bool)
    transforms: dict[int, Halves] = {}
    for block in matrix.blocks():
        sources = tuple(_source(matrix.system, i, y0, y0_rate, plan) for i in block)
        odd, even = np.empty((len(block), k, b, 2 * n)), np.empty((len(block), k, b, 2 * n + 2 * w))
        if len(block) <= 2:
            enclosed &= kernels.solve(matrix.tables(block, plan.table), sources, plan.layout, odd, even)
        else:
            enclosed &= _solve_large(matrix, block, sources, plan, odd, even)
        transforms |= {i: (odd[j], even[j]) for j, i in enumerate(block)}
    return [transforms[i] for i in range(matrix.size)], enclosed


def _source(
    system: LinearFractionalSystem, row: int, y0: Floats, y0_rate: Floats, plan: Plan
) -> tuple[Floats, Floats, Floats]:
    """Return r_i = Σ_{β>1} A_j σ^(β-2) y'(0) - Σ_{β≤0} A_j σ^(β-1) y(0) as coefficients (k, b, Q) and powers."""
    k, b, _ = y0.shape
    coefficients: list[Floats] = []
    exponents: list[Floats] = []
    for term in system.dynamics:
        for column in np.flatnonzero(term.matrix[..., row, :].reshape(-1, system.size).any(axis=0)):
            order = term.orders[..., column]
            if np.all(order <= 0.0):
                coefficient, exponent = -term.matrix[..., row, column] * y0[..., column], order - 1.0
            elif np.all(order > 1.0):
                coefficient, exponent = term.matrix[..., row, column] * y0_rate[..., column], order - 2.0
            else:
                continue
            if np.any(coefficient):
                _collect(coefficients, exponents, np.broadcast_to(coefficient, (k, b)), exponent)
    if not coefficients:
        coefficients, exponents = [np.zeros((k, b))], [np.zeros(())]
    merged = np.ascontiguousarray(np.stack(coefficients, axis=-1))
    return merged, *plan.table(np.stack(np.broadcast_arrays(*exponents), axis=-1))


def _collect(coefficients: list[Floats], exponents: list[Floats], coefficient: Floats, exponent: Floats) -> None:
    """Add a power to a sum of powers, to the one with the same exponent if there is one."""
    for i, known in enumerate(exponents):
        if np.array_equal(known, exponent):
            coefficients[i] = coefficients[i] + coefficient
            return
    coefficients.append(coefficient)
    exponents.append(exponent)


def _solve_large(
    matrix: CharacteristicMatrix,
    block: list[int],
    sources: tuple[tuple[Floats, Floats, Floats], ...],
    plan: Plan,
    odd: Floats,
    even: Floats,
) -> Booleans:
    """Solve three or more coupled coordinates by LAPACK, node by node."""
    shape = (matrix.batch, len(plan.path))
    entries = [[entry(plan.path) if (entry := matrix.entries[i][k]) else None for k in block] for i in block]
    matrices = stack(entries, shape)
    right = np.stack([c @ re + 1j * (c @ im) for c, re, im in (_aligned(source) for source in sources)], axis=-1)
    solution = np.linalg.solve(matrices, right[..., None])[..., 0]
    det = np.linalg.det(matrices)
    enclosed = np.ones(matrix.batch, dtype=bool)
    at = 0
    for number, (first, n) in enumerate(plan.layout):
        stop = plan.layout[number + 1, 0] if number + 1 < len(plan.layout) else len(plan.path)
        turns, steps = crossings(det[:, first:stop])
        enclosed &= (turns == 0.0) & ~steps.any(axis=1) & (det[:, first].real > 0.0)
        part = np.moveaxis(np.asarray(solution[..., first : first + 2 * n + 1, :], dtype=np.complex128), -1, 0)
        start = at + 2 * number
        odd[..., at : at + 2 * n] = _halves(part[..., 1::2])
        even[..., start : start + 2 * n + 2] = _halves(part[..., 0::2])
        at += 2 * n
    return enclosed


def _halves(values: Complexes) -> Floats:
    return np.concatenate([values.real, values.imag], axis=-1)


def _aligned(source: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """Give coefficients (k, b, Q) an axis for matrix products with powers (b, Q, P) of members' own exponents."""
    c, re, im = source
    return (c, re[0], im[0]) if len(re) == 1 else (c[..., None, :], re, im)


def _times_powers(plan: Plan, halves: Halves, order: Floats) -> Halves:
    """Multiply transforms by σ^order with one order a member."""
    odd, even = (half.copy() for half in halves)
    at = 0
    for number, window in enumerate(plan.windows):
        n = window.nodes
        sigma = window.path[: 2 * n + 1]
        for half, start, nodes in ((odd, at, sigma[1::2]), (even, at + 2 * number, sigma[0::2])):
            re, im = half[..., start : start + len(nodes)], half[..., start + len(nodes) : start + 2 * len(nodes)]
            half[..., start : start + 2 * len(nodes)] = _halves((re + 1j * im) * powers(nodes, order))
        at += 2 * n
    return odd, even


def _initial_value(wanted: _Derivative, y0: Floats, y0_rate: Floats) -> tuple[Floats, Floats]:
    """Return what D^γ y has besides σ^γ Z, as c t^p / Γ(p + 1): c (k, b) and p (1,) or (b,).

    D^γ of y(0) for γ ≤ 0; minus the power that σ^γ Z has too much of for 1 < γ; nothing between.
    """
    order, column = wanted.order, wanted.component
    if np.all(order <= 0.0):
        return y0[..., column], np.atleast_1d(-order)
    if np.all(order > 1.0):
        return -y0_rate[..., column], np.atleast_1d(1.0 - order)
    return np.zeros(y0.shape[:-1]), np.zeros(1)
