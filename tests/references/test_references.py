"""The references against each other: three ways to the same number, before any of them judges the package."""

from __future__ import annotations

import itertools

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from tests.references import loops, poles, series
from tests.references.laplace import QuickReference, Reference, transforms
from tests.references.measures import ReferenceMeasures, roots

PAPER_GAINS = [[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]]
OUT_OF_PLANE = [
    loops.out_of_plane(0.85, 2.0, 0.91, [0.0, 0.002]),
    loops.out_of_plane(-0.4, 0.1, 0.55, [1e-3, -1e-3]),
    loops.out_of_plane(3.0, 3.5, 0.99, [-1e-3, 0.0]),
]
IN_PLANE = [
    loops.in_plane(PAPER_GAINS, [0.97, 0.9], [-1e-3, 0.0, 0.0, 2e-3]),
    *loops.random_in_plane(11, 3, spread=1.5),
    loops.in_plane([[-2.0, 1.0, 0.5, -1.0], [0.5, -1.0, 2.0, 0.3]], [0.6, 0.85], [1e-3, -2e-3, 5e-4, 1e-3]),
]


@pytest.mark.parametrize("loop", OUT_OF_PLANE)
@pytest.mark.parametrize("time", [0.02, 1.0, 6.0])
def test_contour_and_power_series_agree_out_of_plane(loop: loops.Loop, time: float) -> None:
    series_value = series.power_series(loop, time, digits=28)[0]
    with mpmath.workdps(40):
        assert abs(Reference(loop, 25).at(time)[0] - series_value) < 1e-25


@pytest.mark.parametrize(("loop", "time"), [(IN_PLANE[0], 0.05), *((loop, 0.4) for loop in IN_PLANE[::2])])
def test_contour_and_power_series_agree_in_plane(loop: loops.Loop, time: float) -> None:
    series_value = series.power_series(loop, time, digits=24)
    computed = Reference(loop, 22).at(time)
    with mpmath.workdps(40):
        assert max(abs(a - b) for a, b in zip(computed[:2], series_value, strict=True)) < 1e-22


@pytest.mark.parametrize("loop", [OUT_OF_PLANE[0], IN_PLANE[0], IN_PLANE[-1]])
@pytest.mark.parametrize(("method", "time"), [("dehoog", 3.0), ("talbot", 12.0)])
def test_contour_and_generic_inversions_agree(loop: loops.Loop, method: str, time: float) -> None:
    """Mpmath's Talbot and de Hoog know no poles; with this many nodes Talbot's contour encloses all of them."""
    degree = 100 if method == "dehoog" else 200
    exact = Reference(loop, 25).at(time)
    with mpmath.workdps(100):

        def transform(index: int, sigma: mpmath.mpc) -> mpmath.mpc:
            return transforms(loop, sigma, [sigma ** mpmath.mpf(float(a)) for a in loop.alpha])[index]

        indices = range(4 * loop.size) if method == "talbot" else range(loop.size)
        for index in indices:
            value = mpmath.invertlaplace(lambda s, k=index: transform(k, s), time, method=method, degree=degree)
            assert abs(value - exact[index]) < 1e-20


@pytest.mark.parametrize(("k_d", "alpha"), [(0.5, 0.5), (2.0, 0.91)])
def test_one_fractional_term_is_a_mittag_leffler_function(k_d: float, alpha: float) -> None:
    loop = loops.out_of_plane(-0.875, k_d, alpha, [1e-3, 2e-3])
    for time in (0.1, 2.0, 8.0):
        with mpmath.workdps(30):
            free = series.damped_free_mass(k_d, alpha, 1e-3, 2e-3, time)
            assert abs(series.power_series(loop.replace(k_p=[[-1.0]]), time)[0] - free) < 1e-24
            oscillator = series.fractional_oscillator(k_d, 0.125, alpha, 1e-3, 2e-3, time)
            assert abs(Reference(loop, 25).at(time)[0] - oscillator) < 1e-24


def test_mittag_leffler_special_values() -> None:
    """E₁,₁(z) = e^z, E₂,₁(-z²) = cos z, E₂,₂(-z²) = sin z/z, E_{1/2,1}(-z) = e^(z²) erfc z."""
    with mpmath.workdps(30):
        z = mpmath.mpf("1.7")
        assert abs(series.mittag_leffler(1, 1, -z) - mpmath.exp(-z)) < 1e-28
        assert abs(series.mittag_leffler(2, 1, -z * z) - mpmath.cos(z)) < 1e-28
        assert abs(series.mittag_leffler(2, 2, -z * z) - mpmath.sin(z) / z) < 1e-28
        assert abs(series.mittag_leffler(0.5, 1, -z) - mpmath.exp(z * z) * mpmath.erfc(z)) < 1e-28


@pytest.mark.parametrize("size", [1, 2])
def test_integer_orders_are_matrix_exponentials(size: int) -> None:
    loop = OUT_OF_PLANE[0].replace(alpha=[1.0]) if size == 1 else IN_PLANE[0].replace(alpha=[1.0, 1.0])
    times = [0.1, 2.0, 12.0, 30.0]
    states, controls = series.matrix_exponential(loop, times)
    values = Reference(loop, 25).digits_at(times)
    np.testing.assert_allclose(values.states, states, atol=1e-15)
    np.testing.assert_allclose(values.control, controls, atol=1e-14)
    with mpmath.workdps(30):
        exact = series.precise_matrix_exponential(loop, 3.0)
        assert max(abs(a - b) for a, b in zip(Reference(loop, 25).at(3.0), exact, strict=False)) < 1e-24


def test_free_motion_is_the_matrix_exponential() -> None:
    times = [0.3, 4.0, 20.0]
    start = [1e-3, -2e-3, 5e-4, 2e-3]
    loop = loops.in_plane(np.zeros((2, 4)), [1.0, 1.0], start)
    np.testing.assert_allclose(
        series.free_in_plane(start, times), series.matrix_exponential(loop, times)[0], atol=1e-14
    )
    loop = loops.out_of_plane(0.0, 0.0, 1.0, start[:2])
    states = series.matrix_exponential(loop, times)[0]
    np.testing.assert_allclose(series.free_out_of_plane(start[:2], times), states, atol=1e-15)


@pytest.mark.parametrize("loop", [*OUT_OF_PLANE, *IN_PLANE])
def test_double_precision_references_keep_eleven_digits(loop: loops.Loop) -> None:
    times = [1e-7, 1e-4, 0.03, 1.0, 7.0, 12.0, 37.0]
    reference = Reference(loop, 20)
    exact, fast, quickest = reference.digits_at(times), reference(times), QuickReference(loop)(times)
    for name in ("position", "rate", "control", "impulse"):
        values = getattr(exact, name)
        peak = np.abs(values).max()
        assert np.abs(getattr(fast, name) - values).max() < 1e-12 * peak
        assert np.abs(getattr(quickest, name) - values).max() < 1e-11 * peak


def test_initial_values_are_limits() -> None:
    for alpha in ([0.9, 0.6], [1.0, 0.6], [1.0, 1.0]):
        reference = Reference(IN_PLANE[0].replace(alpha=alpha), 20)
        limit, start = reference([1e-12]), reference([0.0])
        np.testing.assert_allclose(limit.states, start.states, atol=1e-10)
        np.testing.assert_allclose(limit.control, start.control, atol=3e-4)


def _rational_poles(loop: loops.Loop, denominator: int) -> np.ndarray:
    """Return poles in |arg σ| < π from the polynomial in λ = σ^(1/q) that orders a/q make of det M."""
    q = denominator
    entries = [[np.zeros(2 * q + 1) for _ in range(loop.size)] for _ in range(loop.size)]
    for i in range(loop.size):
        for j in range(loop.size):
            entries[i][j][2 * q] += float(i == j)
            entries[i][j][q] -= loop.damping[i, j]
            entries[i][j][0] += loop.k_p[i, j] - loop.stiffness[i, j]
            entries[i][j][round(loop.alpha[j] * q)] += loop.k_d[i, j]
    polynomials = [[np.polynomial.Polynomial(entry) for entry in row] for row in entries]
    zeros = poles.determinant(polynomials).trim(1e-14).roots()
    zeros = zeros[np.abs(np.angle(zeros)) < np.pi / q - 1e-9]
    return np.sort_complex(zeros**q)


@pytest.mark.parametrize("seed", range(6))
def test_poles_agree_with_the_pseudo_state_polynomial(seed: int) -> None:
    """Matignon's route: orders that are multiples of 1/20 make det M a polynomial in σ^(1/20)."""
    loop = next(loops.random_in_plane(100 + seed, 1, spread=None if seed % 2 else 1.5))
    loop = loop.replace(alpha=np.round(loop.alpha * 20).clip(10, 19) / 20)
    np.testing.assert_allclose(np.sort_complex(poles.poles(loop)), _rational_poles(loop, 20), rtol=1e-6, atol=1e-8)


def test_pole_counts_are_complete_on_random_loops() -> None:
    counts = set()
    for loop in loops.random_in_plane(5, 60):
        found = poles.poles(loop)
        counts.add(len(found))
        assert poles.unstable_count(loop) == np.sum(found.real > 0)
    assert min(counts) >= 2
    assert len(counts) > 2


def test_pole_functions_refuse_marginal_loops() -> None:
    with pytest.raises(ArithmeticError, match="marginal"):
        poles.unstable_count(loops.out_of_plane(0.0, 0.0, 0.9, [1.0, 0.0]))


def test_impulse_is_the_integral_of_the_control() -> None:
    """Adaptive quadrature with the weight s^(1-α) of the start taken out by s = y^4."""
    loop = loops.out_of_plane(0.85, 2.0, 0.91, [0.0, 0.002])
    reference = Reference(loop, 20)

    def integrand(y: float) -> float:
        return abs(float(reference([y**4]).control[0, 0])) * 4.0 * y**3

    measures = ReferenceMeasures(reference, 12.0)
    zeros = roots(lambda s: reference(s).control[:, 0], measures.grid)
    ends = np.concatenate([[0.0], zeros, [12.0]]) ** 0.25
    total = sum(quad(integrand, *pair, epsabs=1e-13, epsrel=1e-11)[0] for pair in itertools.pairwise(ends))
    assert measures.control_effort() == pytest.approx(total, rel=1e-9)


def test_measures_of_a_damped_oscillator_in_closed_form() -> None:
    """w'' + 2ζw' + w = 0, w₀ = -1, at rest: the first overshoot is exp(-πζ/√(1-ζ²)), at s = π/√(1-ζ²)."""
    zeta = 0.3
    loop = loops.out_of_plane(0.0, 2.0 * zeta, 1.0, [-1.0, 0.0])
    measures = ReferenceMeasures(Reference(loop, 20), 12.0 * np.pi)
    damped = np.sqrt(1.0 - zeta**2)
    peak = np.exp(-np.pi * zeta / damped)
    assert measures.overshoot(scale=1.0) == pytest.approx(1.0 + peak, rel=1e-12)
    settled = measures.settling_time(0.9 * peak)
    x = float(measures.reference([settled]).position[0, 0])
    assert abs(x) == pytest.approx(0.9 * peak, rel=1e-12)
    assert np.pi / damped < settled < 1.5 * np.pi / damped
    assert measures.sampled_settling_time(0.9 * peak) == pytest.approx(np.floor(settled * 100) / 100)


@pytest.mark.parametrize("k_d", [1e-2, -1e-2, -1e-5])
def test_counts_see_two_pole_pairs_close_to_the_axis_and_to_each_other(k_d: float) -> None:
    """Two equal oscillators: det M is a square and its argument turns by 2π within |k_D| of ω = 1."""
    loop = loops.Loop(-np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), k_d * np.eye(2), np.array([0.9, 0.9]), np.ones(4))
    assert poles.unstable_count(loop) == (0 if k_d > 0 else 4)
