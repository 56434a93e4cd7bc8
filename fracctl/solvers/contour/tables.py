"""What a plan gives the contour engine for loops of certain orders: powers, kernels, and functions of time.

Members that share their orders share all of it, and it is kept for the next batch.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import rgamma

from fracctl.arrays import Array, Floats
from fracctl.fractional.series import Recipe, differentiated
from fracctl.fractional.terms import powers
from fracctl.solvers.contour.engine import Start, Windows
from fracctl.solvers.contour.loops import Loops
from fracctl.solvers.contour.own import own, own_powers, own_shapes, own_start
from fracctl.solvers.contour.plan import Plan, last_coefficients


def tables(plan: Plan, loops: Loops, members: Array) -> tuple[Floats, Start, Windows]:
    """Return the powers along the path, see `Members.table`, the series and the windows for some of the loops."""
    if loops.shared:
        exponents = tuple(float(order) for order in loops.exponents)
        orders = tuple(float(wanted.order) for wanted in loops.derivatives)
        added = tuple(float(power) for power in loops.powers)
        return (
            _shared_powers(plan, exponents),
            _shared_start(plan, loops.recipe, orders),
            _shared_windows(plan, loops.kernels, added),
        )

    kept = list(loops.recipe.exponents[: loops.recipe.kept])
    shapes = own_shapes(plan, own(loops.powers, members))
    matrix = own_start(plan, own(kept, members), own([wanted.order for wanted in loops.derivatives], members))
    return (
        own_powers(plan, loops.exponents, members),
        _start(plan, loops.recipe, matrix),
        _shared_windows(plan, loops.kernels, ())._replace(shapes=shapes),
    )


@lru_cache(maxsize=64)
def _shared_powers(plan: Plan, exponents: tuple[float, ...]) -> Floats:
    values = powers(plan.path, np.array(exponents))
    return np.ascontiguousarray(np.moveaxis(np.stack([values.real, values.imag], axis=1), -1, 0)[None])


@lru_cache(maxsize=64)
def _shared_start(plan: Plan, recipe: Recipe, orders: tuple[float, ...]) -> Start:
    return _start(plan, recipe, _start_matrix(plan, recipe.exponents[: recipe.kept], np.array(orders))[None])


@lru_cache(maxsize=64)
def _shared_windows(plan: Plan, exponents: tuple[tuple[float, ...], ...], added: tuple[float, ...]) -> Windows:
    """Return the windows for kernels of some exponents a request, and the shapes t^p / Γ(p + 1)."""
    first = np.cumsum([0, *(len(window.path) for window in plan.windows)])
    numbers = [
        (first[i], first[i + 1], window.nodes, window.where.start, len(window.times), window.rows)
        for i, window in enumerate(plan.windows)
    ]
    kernels = [kernel for request in exponents for window in plan.windows for kernel in window.kernels(request)]
    places = np.cumsum([0, *(kernel.size for kernel in kernels)])[:-1].reshape(len(exponents), -1, 2)
    flat = np.concatenate([kernel.ravel() for kernel in kernels])
    checked = np.stack([window.checked for window in plan.windows])
    return Windows(np.array(numbers), checked, flat, places, np.ascontiguousarray(_shapes(plan, np.array(added))[None]))


def _shapes(plan: Plan, exponents: Floats) -> Floats:
    """Return rows of t^p / Γ(p + 1) on all windows for exponents (w,), (w, rows)."""
    parts: list[Floats] = []
    for window in plan.windows:
        values = window.times[:, None] ** exponents * rgamma(exponents + 1.0)
        parts += [values, window.last @ values]
    return np.concatenate(parts).T


def _start(plan: Plan, recipe: Recipe, matrix: Floats) -> Start:
    nodes = plan.grid.panels[0].nodes
    return Start(np.array([0, nodes, nodes + 3]), recipe.steps, recipe.sizes, np.ascontiguousarray(matrix))


def _start_matrix(plan: Plan, exponents: Floats, orders: Floats) -> Floats:
    """Return the matrix from powers (E,) to rows of derivatives (w,) on the first panel, (w, rows, E).

    The last row is the value at 0+.
    """
    nodes = plan.grid.panels[0].nodes
    last, times = last_coefficients(plan.grid, slice(0, nodes)), np.append(plan.grid.times[:nodes], 0.0)
    matrices = []
    for order in orders:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = differentiated(exponents, order, times).T
        matrices.append(np.concatenate([values[:nodes], last @ values[:nodes], values[nodes:]]))
    return np.stack(matrices)
