"""Transforms of a batch of linear fractional loops at the nodes of all contours of a plan.

With y = y(0) + z the transform Z of z solves M(σ) Z = r(σ), and M̃ Z̃ = r for Z̃ = σ^ℓ Z.
"""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Booleans, Complexes, Floats
from fracctl.characteristic import kernels
from fracctl.characteristic.matrix import CharacteristicMatrix, stack
from fracctl.characteristic.winding import crossings
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import powers
from fracctl.solvers.contour_plan import Plan

Halves = tuple[Floats, Floats]
"""Z̃ at the odd and at the even nodes of all contours, (k, b, Σ 2N) and (k, b, Σ (2N + 2)), real parts first."""


def transforms(matrix: CharacteristicMatrix, y0: Floats, y0_rate: Floats, plan: Plan) -> tuple[list[Halves], Booleans]:
    """Return Z̃ of each coordinate at odd and even nodes, and whether all contours enclose all poles, (b,)."""
    k, b, _ = y0.shape
    n, w = int(plan.layout[:, 1].sum()), len(plan.windows)
    enclosed = np.ones(b, dtype=bool)
    solved: dict[int, Halves] = {}
    for block in matrix.blocks():
        sources = tuple(_source(matrix.system, i, y0, y0_rate, plan) for i in block)
        odd, even = np.empty((len(block), k, b, 2 * n)), np.empty((len(block), k, b, 2 * n + 2 * w))
        if len(block) <= 2:
            enclosed &= kernels.solve(matrix.tables(block, plan.table), sources, plan.layout, plan.order, odd, even)
        else:
            enclosed &= _solve_large(matrix, block, sources, plan, odd, even)
        solved |= {i: (odd[j], even[j]) for j, i in enumerate(block)}
    return [solved[i] for i in range(matrix.size)], enclosed


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
    det = np.linalg.det(matrices)[:, plan.order]
    enclosed = np.ones(matrix.batch, dtype=bool)
    at = 0
    for number, (first, n) in enumerate(plan.layout):
        stop = plan.layout[number + 1, 0] if number + 1 < len(plan.layout) else len(plan.path)
        turns, steps = crossings(det[:, first:stop])
        enclosed &= (turns == 0.0) & ~steps.any(axis=1) & (det[:, first].real > 0.0)
        part = np.moveaxis(np.asarray(solution[..., first : first + 2 * n + 1, :], dtype=np.complex128), -1, 0)
        start = at + 2 * number
        odd[..., at : at + 2 * n] = _halves(part[..., :n])
        even[..., start : start + 2 * n + 2] = _halves(part[..., n:])
        at += 2 * n
    return enclosed


def _halves(values: Complexes) -> Floats:
    return np.concatenate([values.real, values.imag], axis=-1)


def _aligned(source: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """Give coefficients (k, b, Q) an axis for matrix products with powers (b, Q, P) of members' own exponents."""
    c, re, im = source
    return (c, re[0], im[0]) if len(re) == 1 else (c[..., None, :], re, im)


def times_powers(plan: Plan, halves: Halves, order: Floats) -> Halves:
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
