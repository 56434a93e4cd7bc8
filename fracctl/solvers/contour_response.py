"""Responses of a batch of linear fractional loops on the windows of a plan.

One fill of the transforms Z̃ = σ^ℓ Z of z = y - y(0) serves every derivative of every coordinate: D^γ z(t) is a real
matrix product with the kernel of σ^(γ - ℓ), in which no initial value cancels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import rgamma

from fracctl.arrays import Booleans, Floats
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.fractional.series import short_time_series
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.solvers.contour_kernels import controls_and_errors, place
from fracctl.solvers.contour_plan import Plan
from fracctl.solvers.contour_transforms import Halves, times_powers, transforms
from fracctl.solvers.outputs import Values

SAFETY = 6.0
"""Estimate over the largest difference seen: the two rules and the times compared are few."""


@dataclass(frozen=True)
class _Derivative:
    """D^order of one coordinate, to be computed; `order` is a number or (b,)."""

    component: int
    order: Floats


def respond(
    system: LinearFractionalSystem, y0: Floats, y0_rate: Floats, plan: Plan, with_rates: bool
) -> tuple[Values, Booleans]:
    """Solve the members of `system` from y(0), y'(0), each (k, b, p) or (k, 1, p), on the grid of `plan`.

    Returns:
        The values, with the differences of the two quadrature rules and the remainders of interpolation and series
        as their error, and whether (b,) every contour has all poles on its left.
    """
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
    found = Values(
        positions=np.moveaxis(values[:m], 0, 2),
        rates=np.moveaxis(values[p : p + m], 0, 2) if with_rates else None,
        auxiliary=np.moveaxis(values[m:p], 0, 2),
        controls=controls,
        initial_controls=np.einsum("bmw,wkb->kbm", gains, initial[..., 0]),
        error=errors.max(axis=0),
    )
    return found, enclosed


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
    solved, enclosed = transforms(CharacteristicMatrix(system), y0, y0_rate, plan)
    for component in range(p):
        wanted = [i for i, order in enumerate(orders) if order.component == component]
        for places, exponents, halves in _requests(system, plan, solved[component], wanted, orders):
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
            yield [i], (-highest,), times_powers(plan, halves, orders[i].order)


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
