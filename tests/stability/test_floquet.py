"""Floquet multipliers under delayed feedback against published and independently computed values."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fracctl.controllers import DelayedFeedback
from fracctl.design.lqr import lqr
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop
from fracctl.plants import HCW, Chief, FunctionPlant, Libration, RelativeMotion, RotatingEllipsoid
from fracctl.solvers import MethodOfSteps
from fracctl.stability import PeriodicOrbit, multipliers, nontrivial_multipliers, real_above_one, residual, shoot
from fracctl.stability.floquet import periodic_directions

TURN = 2.0 * np.pi


@cache
def libration() -> PeriodicOrbit:
    return shoot(Libration(), [-0.28, -1.07], TURN)


@cache
def formation() -> PeriodicOrbit:
    """A follower 20 km away from a leader at 6700 km, with the leader's period."""
    x = 20.0 / 6700.0
    return shoot(RelativeMotion(Chief(6700.0)), [x, 0.0, 0.0, 0.0, -2.0 * x, 0.0], TURN)


def largest(k: float, recall: float = 0.0) -> complex:
    return complex(multipliers(libration(), [[0.0, k]], recall)[0])


def test_libration_without_control_is_a_flip_saddle() -> None:
    values = multipliers(libration())
    np.testing.assert_allclose(values, [-3.366, -0.213], atol=5e-4)
    assert real_above_one(values) == 0
    free = MethodOfSteps().solve(ClosedLoop(Libration()), libration().state, TURN)
    np.testing.assert_allclose(free([TURN])[0], libration().state, atol=1e-11)


def test_stable_window_of_the_libration() -> None:
    """0.184 < k < 0.461; below a flip through -1, above a pair of complex multipliers."""
    assert abs(largest(0.1835)) > 1.0
    assert abs(largest(0.1845)) < 1.0
    assert abs(largest(0.4600)) < 1.0
    assert abs(largest(0.4615)) > 1.0
    assert abs(largest(0.4615).imag) > 0.9


@pytest.mark.parametrize(("recall", "lower", "stable"), [(0.0, 0.1842, 0.3), (0.3, 0.2395, 1.0), (0.6, 0.2947, 1.5)])
def test_recall_moves_the_flip_and_widens_the_window(recall: float, lower: float, stable: float) -> None:
    assert largest(lower, recall) == pytest.approx(-1.0, abs=5e-4)
    assert abs(largest(lower - 2e-3, recall)) > 1.0 > abs(largest(lower + 2e-3, recall))
    assert abs(largest(stable, recall)) < 1.0


@pytest.mark.parametrize("recall", [0.0, 0.5])
def test_multipliers_satisfy_the_characteristic_equation(recall: float) -> None:
    """By another integrator; the nodes converge exponentially."""
    gain, errors = [[0.05, 0.3]], []
    for nodes in (40, 60, 100):
        values = multipliers(libration(), gain, recall, nodes)[:4]
        errors.append(max(residual(libration(), gain, value, recall) for value in values))
    assert errors[0] < 1e-2
    assert errors[1] < 1e-2 * errors[0]
    assert errors[2] < 1e-9
    assert residual(libration(), gain, 1.01 * values[0], recall) > 1e-4


def test_runs_decay_as_the_largest_multiplier_says() -> None:
    """From near the orbit, over 10 periods, with a real multiplier: k = 0.186 and -0.93."""
    value, period = largest(0.186), np.arange(2, 30) * TURN
    loop = ClosedLoop(Libration(), DelayedFeedback([[0.0, 0.186]], TURN))
    run = MethodOfSteps().solve(loop, libration().state + np.array([1e-7, 0.0]), period[-1])
    gaps = run(period)[:, 1] - libration().state[1]
    assert abs(value.imag) < 1e-9
    np.testing.assert_allclose(gaps[-6:] / gaps[-7:-1], value.real, rtol=1e-2)


@pytest.mark.parametrize(
    ("beta", "expected"), [(0.01, 1.267), (1.0, 1.250), (10.0, 1.147), (100.0, 0.792), (1e3, 0.445), (1e6, 0.922)]
)
def test_formation_against_the_weight_of_control(beta: float, expected: float) -> None:
    """LQR of Hill's equations, Q = I, R = βI; five multipliers are 1, for the family of orbits of equal period."""
    gain = lqr(HCW(), 1.0, beta)
    assert abs(nontrivial_multipliers(formation(), gain)[0]) == pytest.approx(expected, abs=2e-3)
    assert np.count_nonzero(np.abs(multipliers(formation(), gain) - 1.0) < 1e-5) == 5


@pytest.mark.parametrize("recall", [0.0, 0.4])
def test_deflation_leaves_all_other_multipliers(recall: float) -> None:
    """About Eros the tangent alone belongs to a periodic solution, and the multipliers are 1 and the deflated ones."""
    plant = RotatingEllipsoid()
    orbit = shoot(plant, [-0.187, 0.937, 1.866, 0.335], 3.10656)
    direction = periodic_directions(orbit)
    tangent = plant.rates(np.zeros(1), orbit.state[None], np.zeros((1, 2)))[0]
    np.testing.assert_allclose(np.abs(direction[:, 0] @ tangent), np.linalg.norm(tangent), rtol=1e-8)
    assert direction.shape == (4, 1)
    gain = [[0.0525, -0.1243, 0.1169, 0.0373], [0.1243, 0.0525, -0.0373, 0.1169]]
    all_values = list(multipliers(orbit, gain, recall)[:6])
    others = nontrivial_multipliers(orbit, gain, recall)[:5]
    unit = min(all_values, key=lambda value: abs(value - 1.0))
    assert unit == pytest.approx(1.0, abs=1e-9)
    all_values.remove(unit)
    np.testing.assert_allclose(np.sort_complex(all_values), np.sort_complex(others), atol=1e-7)


def test_a_one_that_no_periodic_solution_has_is_kept() -> None:
    """x'' = 0: Φ = [[1, T], [0, 1]] has the multiplier 1 twice and one periodic solution."""
    plant = FunctionPlant(lambda t, x, u: np.stack([x[:, 1], u[:, 0]], 1), 2, 1)
    assert nontrivial_multipliers(PeriodicOrbit(plant, np.zeros(2), 1.0)) == pytest.approx([1.0])
    assert nontrivial_multipliers(libration()) == pytest.approx(multipliers(libration()))


def test_a_gain_that_depends_on_time() -> None:
    """x' = a x - k(t) (x - x(t-T)) about 0: μ = exp(a T - (1 - 1/μ) ∫ k dt); the recall divides by μ - R."""
    plant = FunctionPlant(lambda t, x, u: 0.3 * x + u, 1, 1)
    orbit = PeriodicOrbit(plant, np.zeros(1), 1.5)
    for recall in (0.0, 0.4):
        values = multipliers(orbit, lambda t: 0.4 + np.sin(TURN * t / 1.5)[..., None, None], recall)
        assert abs(values[0]) > 1.0
        for value in values[: 1 if recall else 3]:
            factor = (value - 1.0) / (value - recall)
            assert abs(np.exp((0.3 - 0.4 * factor) * 1.5) / value - 1.0) < 1e-8


def test_a_constant_orbit_has_the_multipliers_of_the_characteristic_equation() -> None:
    """x' = a x + u about 0: μ = exp((a - k (1 - 1/μ)) T)."""
    plant = FunctionPlant(lambda t, x, u: 0.3 * x + u, 1, 1)
    orbit = PeriodicOrbit(plant, np.zeros(1), 1.5)
    for value in multipliers(orbit, [[0.4]])[:3]:
        assert abs(np.exp((0.3 - 0.4 * (1.0 - 1.0 / value)) * 1.5) / value - 1.0) < 1e-9


def test_real_multipliers_above_one_are_counted() -> None:
    assert real_above_one(np.array([1.2 + 0j, -3.0, 1.5 + 0.1j, 1.0, 2.0])) == 2


def test_bad_input_is_refused_in_sentences() -> None:
    with pytest.raises(ArgumentError, match=r"`gain` must have shape \(1, 2\) for this plant"):
        multipliers(libration(), [[1.0]])
    with pytest.raises(ArgumentError, match="`nodes` must be at least 40, but is 39"):
        multipliers(libration(), [[0.0, 0.3]], nodes=39)
    with pytest.raises(ArgumentError, match=r"`recall` must lie in \[0, 1\]"):
        multipliers(libration(), [[0.0, 0.3]], recall=-0.1)
    grows = FunctionPlant(lambda t, x, u: 1.0 + x**2, 1, 1)
    with pytest.raises(ArgumentError, match="`guess` must lie near an orbit of period 1, but is"):
        shoot(grows, [0.0], 1.0)
