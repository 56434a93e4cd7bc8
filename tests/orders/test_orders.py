r"""Orders of convergence: slopes of log error over log N, against theory, to ±0.25.

Near 0 the solution is a sum of powers t^e. With y(0), y'(0) and a term D^α, e = 1 + j(2-α) + 2i for the part of
y'(0), e = 2 + j(2-α) + 2i for that of y(0) (Caputo's derivative takes the constant to 0, so that the first power of
y(0) that is no integer is 4-α).

Chebyshev coefficients of t^s on [0, S] decay as n^(-2s-1) where s is no integer, so that integrals of the polynomial
through N nodes are wrong by N^(-2s-2) (Clenshaw-Curtis quadrature of a function with t^s at an end). Both methods
integrate a polynomial through values of y'' ~ t^(e-2) twice: the positions converge as

    N^(-2(e-1)),    e the smallest power that is no integer and not taken out

Fractional Chebyshev collocation takes out nothing: 2(2-α) with y'(0), 2(3-α) with y(0) alone. Volterra collocation
takes out all powers up to an exponent; the orders here are those with fewer powers than it takes by default. Where e
is close to an integer, its amplitude sin(πe) is so small that later powers hide it; such pairs are left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fracctl.fractional.collocation import integral_matrix
from fracctl.fractional.series import short_time_series
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.solvers import Collocation, Volterra
from fracctl.solvers.members import Members
from fracctl.solvers.volterra.panels import UniformPanels
from fracctl.solvers.volterra.solution import Solution
from tests.references import loops
from tests.references.laplace import QuickReference, Reference
from tests.references.loops import Loop
from tests.references.product import closed_loop

WITHIN = 0.25
FORMS = ["second_order", "first_order"]


def order(counts: list[int], errors: list[float]) -> float:
    return -float(np.polyfit(np.log(counts), np.log(errors), 1)[0])


def collocation_error(member: Loop, degree: int, form: str, horizon: float) -> float:
    """Return the largest error of the positions over their peak."""
    times = np.linspace(0.02, 1.0, 150) * horizon
    exact = QuickReference(member)(times).position
    trajectory = Collocation(degree, form).solve(closed_loop([member]), member.start, horizon)
    return float(np.abs(trajectory(times)[0, :, : member.size] - exact).max() / np.abs(exact).max())


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("alpha", [0.5, 0.7, 0.91])
@pytest.mark.parametrize(("start", "exponent"), [([0.0, 0.002], 3.0), ([0.001, 0.002], 3.0), ([0.001, 0.0], 4.0)])
def test_collocation_out_of_plane(alpha: float, start: list[float], exponent: float, form: str) -> None:
    member = loops.out_of_plane(0.85, 2.0, alpha, start)
    counts = [32, 45, 64, 90, 128]
    errors = [collocation_error(member, n, form, 4.0 * np.pi) for n in counts]
    assert order(counts, errors) == pytest.approx(2.0 * (exponent - alpha - 1.0), abs=WITHIN)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("rates", "exponent"), [([0.0, 0.002], 3.0), ([0.0, 0.0], 4.0)])
def test_collocation_in_plane(rates: list[float], exponent: float, form: str) -> None:
    """The coupling hands the singular power of each component to the other: the larger order decides."""
    alpha = [0.55, 0.75]
    member = loops.in_plane([[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]], alpha, [-1e-3, 1e-3, *rates])
    counts = [45, 64, 90, 128]
    errors = [collocation_error(member, n, form, 4.0 * np.pi) for n in counts]
    assert order(counts, errors) == pytest.approx(2.0 * (exponent - max(alpha) - 1.0), abs=WITHIN)


@pytest.mark.parametrize("start", [[0.0, 0.002], [0.001, 0.0]])
def test_the_measured_errors_of_the_papers_method(start: list[float]) -> None:
    """α = 0.91, k = (0.85, 2) over six periods, as measured before this package: too coarse for a threshold of 1 %."""
    member = loops.out_of_plane(0.85, 2.0, 0.91, start)
    errors = [collocation_error(member, n, "second_order", 12.0 * np.pi) for n in (32, 64, 128)]
    if start[1]:
        assert errors == pytest.approx([5.6e-3, 1.2e-3, 2.7e-4], rel=0.06)
    else:
        assert errors[2] < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_collocation_is_spectral_where_the_solution_is_smooth(form: str) -> None:
    """α = 1: an entire function; the error falls faster than any power of N, down to rounding."""
    member = loops.out_of_plane(0.85, 2.0, 1.0, [0.001, 0.002])
    errors = {}
    times = np.linspace(0.02, 1.0, 150) * 4.0 * np.pi
    frequency = np.sqrt(0.85 + 1.0 - 1.0)
    exact = np.exp(-times) * (0.001 * np.cos(frequency * times) + 0.003 / frequency * np.sin(frequency * times))
    for n in (8, 12, 16, 20, 28):
        trajectory = Collocation(n, form).solve(closed_loop([member]), member.start, 4.0 * np.pi)
        errors[n] = np.abs(trajectory(times)[0, :, 0] - exact).max() / np.abs(exact).max()
    assert errors[28] < 1e-11
    slopes = [np.log(errors[a] / errors[b]) / np.log(b / a) for a, b in ((8, 12), (12, 16), (16, 20))]
    assert slopes[0] < slopes[1] < slopes[2]
    assert slopes[2] > 15.0


@pytest.mark.parametrize(
    ("alpha", "start", "removed", "exponent"),
    [
        (0.91, [0.0, 1.0], 1.5, 2.09),
        (0.7, [0.0, 1.0], 1.5, 2.3),
        (0.7, [0.0, 1.0], 2.5, 3.6),
        (0.7, [1.0, 0.0], 2.5, 3.3),
        (0.5, [0.0, 1.0], 1.5, 2.5),
        (0.5, [0.0, 1.0], 2.5, 4.5),
        (0.5, [1.0, 0.0], 2.5, 3.5),
        (0.3, [0.0, 1.0], 1.5, 2.7),
        (0.3, [1.0, 0.0], 1.5, 3.7),
    ],
)
def test_volterra_with_few_powers_taken_out(alpha: float, start: list[float], removed: float, exponent: float) -> None:
    """At α = 0.5 the power 1 + 2(2-α) = 4 is an integer, the next one 1 + (2-α) + 2 = 4.5."""
    horizon = 1.0
    member = loops.out_of_plane(0.85, 2.0, alpha, start)
    system = _shared(member, horizon)
    times = np.linspace(0.05, 1.0, 14) * horizon
    exact = Reference(member, 20).digits_at(times).position[:, 0]
    series = short_time_series(system, member.value[None, None], member.rate[None, None], removed)
    counts, errors = [], []
    for degree in (32, 48, 64, 96, 128):
        panels = UniformPanels(horizon, 1, degree + 1)
        rest = integral_matrix(degree + 1, 2.0, times / horizon) @ Solution(system, series, panels).highest[0, 0, 0, 0]
        error = np.abs(series.derivative(0, 0.0, times)[0, 0] + horizon**2 * rest - exact).max()
        if error > 3e-14:
            counts.append(degree)
            errors.append(float(error / np.abs(exact).max()))
    assert len(counts) >= 3
    assert order(counts, errors) == pytest.approx(2.0 * (exponent - 1.0), abs=WITHIN)


def _shared(member: Loop, horizon: float) -> LinearFractionalSystem:
    blank = np.zeros((1, 1, member.size))
    system = replace(closed_loop([member]).system, batch=1)
    return Members(system, blank, blank, horizon, every=False).take(np.zeros(1, dtype=int)).system


@pytest.mark.parametrize("alpha", [0.5, 0.7, 0.91])
def test_volterra_as_it_comes(alpha: float) -> None:
    """All powers up to 7 are taken out, so that the order is at least 2(7-1): half the nodes cost three digits."""
    member = loops.out_of_plane(0.85, 2.0, alpha, [1e-3, 2e-3])
    horizon = 2.0 * np.pi
    times = np.linspace(0.02, 1.0, 60) * horizon
    exact = QuickReference(member)(times).position[:, 0]
    errors = {}
    for n in (8, 12, 16, 32):
        trajectory = Volterra(n, panels=1).solve(closed_loop([member]), member.start, horizon)
        errors[n] = np.abs(trajectory(times)[0, :, 0] - exact).max() / np.abs(exact).max()
    assert order([8, 12, 16], [errors[n] for n in (8, 12, 16)]) > 12.0 - WITHIN
    assert errors[32] < 1e-11
