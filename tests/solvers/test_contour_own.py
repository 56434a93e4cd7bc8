"""Tables of members with orders of their own, against powers and Caputo derivatives of powers by mpmath."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from fracctl.solvers.contour.lanes import LANES
from fracctl.solvers.contour.own import own, own_powers, own_shapes, own_start
from fracctl.solvers.contour.plan import make_plan

PLAN = make_plan(12.0, 3.0, 5.0, 0.0, 5e-10, 5)
COUNT = LANES + 6
MEMBERS = np.arange(COUNT)
SOME = [0, 1, LANES - 1, COUNT - 1]
RANDOM = np.random.default_rng(3)


def block(member: int) -> tuple[int, int]:
    return member // LANES, member % LANES


@pytest.mark.parametrize("limits", [(-3.0, -2.0), (-1.5, -1.0), (-1.0, 0.3), (0.5, 0.5)])
def test_powers_along_the_path(limits: tuple[float, float]) -> None:
    orders = RANDOM.uniform(*limits, COUNT)
    orders[:2] = limits
    table = own_powers(PLAN, [np.array(-2.0), orders], MEMBERS)
    for member in SOME:
        number, lane = block(member)
        for node in range(0, len(PLAN.path), 7):
            for column, order in enumerate((-2.0, orders[member])):
                exact = complex(mpmath.mpc(PLAN.path[node]) ** mpmath.mpf(order))
                re, im = table[number, node, column, :, lane]
                assert abs(complex(re, im) - exact) < 2e-14 * abs(exact)


def test_functions_of_time() -> None:
    orders = RANDOM.uniform(-0.9, 1.0, COUNT)
    shapes = own_shapes(PLAN, own([np.zeros(()), orders], MEMBERS))
    first, window = PLAN.windows[0].rows, PLAN.windows[1]
    for member in SOME:
        number, lane = block(member)
        for i in (0, len(window.times) - 1):
            p = mpmath.mpf(orders[member])
            exact = float(mpmath.mpf(window.times[i]) ** p * mpmath.rgamma(p + 1))
            assert shapes[number, 1, first + i, lane] == pytest.approx(exact, rel=1e-13)
            assert shapes[number, 0, first + i, lane] == 1.0


@pytest.mark.parametrize("limits", [(0.5, 0.9), (-0.9, -0.3), (1.2, 1.7)])
def test_derivatives_of_powers(limits: tuple[float, float]) -> None:
    """D^γ t^e / Γ(e + 1) = t^(e-γ) / Γ(e - γ + 1), zero for e = 0 < γ and for e = 1 < γ; at 0+ it is 0 or constant."""
    order, exponent = RANDOM.uniform(*limits, COUNT), RANDOM.uniform(2.0, 4.0, COUNT)
    exponents = [np.zeros(()), np.ones(()), exponent]
    matrices = own_start(PLAN, own(exponents, MEMBERS), own([np.zeros(()), order], MEMBERS))
    nodes = PLAN.grid.panels[0].nodes
    for member in SOME:
        number, lane = block(member)
        for w, gamma in enumerate((0.0, order[member])):
            for k, e in enumerate((0.0, 1.0, exponent[member])):
                power = mpmath.mpf(e) - mpmath.mpf(gamma)
                killed = k < 2 and gamma > e
                for row in (0, nodes // 2, nodes - 1):
                    time = mpmath.mpf(PLAN.grid.times[row])
                    exact = 0.0 if killed else float(time**power * mpmath.rgamma(power + 1))
                    assert matrices[number, w, row, k, lane] == pytest.approx(exact, rel=1e-13)
                assert matrices[number, w, -1, k, lane] == (1.0 if e == gamma else 0.0)
