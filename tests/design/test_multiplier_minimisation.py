"""Minimised multipliers against a closed form, and about Eros against published gains."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import differential_evolution
from scipy.special import lambertw

from fracctl.design import ROTATIONS, minimise_largest_multiplier
from fracctl.errors import ArgumentError
from fracctl.plants import FunctionPlant, RotatingEllipsoid
from fracctl.stability import PeriodicOrbit, nontrivial_multipliers, shoot

RATE, PERIOD = complex(0.15, 2.1), 1.3


def spiral() -> PeriodicOrbit:
    """z' = λ z + u about 0."""
    matrix = np.array([[RATE.real, -RATE.imag], [RATE.imag, RATE.real]])
    return PeriodicOrbit(FunctionPlant(lambda t, x, u: x @ matrix.T + u, 2, 2), np.zeros(2), PERIOD)


def largest(coefficients: np.ndarray) -> float:
    """max |μ| of z' = λ z - k (z - z(t - T)): μ = exp((λ - k + k/μ) T) = k T / W(k T exp((k - λ) T))."""
    gain = complex(*coefficients) * PERIOD
    return max(abs(gain / lambertw(gain * np.exp(gain - RATE * PERIOD), branch)) for branch in (-2, -1, 0, 1, 2))


def test_a_spiral_in_closed_form() -> None:
    basis = [np.eye(2), [[0.0, -1.0], [1.0, 0.0]]]
    found = minimise_largest_multiplier([spiral()], basis, starts=6, seed=3, reach=1.0)
    assert found.largest[0] == pytest.approx(largest(found.coefficients), rel=1e-6)
    best = differential_evolution(largest, [(-2.0, 2.0), (-2.0, 2.0)], rng=1, tol=1e-8)
    assert found.largest[0] == pytest.approx(best.fun, abs=2e-3)
    np.testing.assert_allclose(found.gain, np.tensordot(found.coefficients, basis, 1))
    again = minimise_largest_multiplier([spiral()], basis, starts=6, seed=3, reach=1.0)
    np.testing.assert_array_equal(again.coefficients, found.coefficients)


def test_orbits_about_eros_do_better_than_with_known_gains() -> None:
    """Gains A hold both orbits, with 0.61 and 0.87."""
    plant = RotatingEllipsoid()
    orbits = [
        shoot(plant, [-0.187, 0.937, 1.866, 0.335], 3.10656),
        shoot(plant, [0.356, 0.652, 1.633, -0.693], 2.59471),
    ]
    known = np.tensordot([0.0525, -0.1243, 0.1169, 0.0373], ROTATIONS, 1)
    bound = max(abs(nontrivial_multipliers(orbit, known)[0]) for orbit in orbits)
    assert 0.8 < bound < 1.0
    found = minimise_largest_multiplier(orbits, ROTATIONS, starts=2, seed=2, reach=0.2, evaluations=60)
    assert found.largest.max() < bound
    assert found.evaluations <= 32 + 2 * 60


def test_the_structure_of_the_gains() -> None:
    gain = np.tensordot([1.0, 2.0, 3.0, 4.0], ROTATIONS, 1)
    np.testing.assert_array_equal(gain, [[1.0, 2.0, 3.0, 4.0], [-2.0, 1.0, -4.0, 3.0]])


def test_bad_input_is_refused_in_sentences() -> None:
    with pytest.raises(ArgumentError, match="`orbits` must be one or more, but is none"):
        minimise_largest_multiplier([], ROTATIONS)
    with pytest.raises(ArgumentError, match=r"`basis` must have shape \(k, 2, 2\), but is of shape \(4, 2, 4\)"):
        minimise_largest_multiplier([spiral()], ROTATIONS)
    with pytest.raises(ArgumentError, match="`starts` must be positive, but is 0"):
        minimise_largest_multiplier([spiral()], [np.eye(2)], starts=0)
