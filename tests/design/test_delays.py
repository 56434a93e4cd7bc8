"""Delays from the free motion against closed forms and returns computed independently of this project."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.design.delays import first_return, natural_period
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.plants import HCW, FunctionPlant, Libration, LinearPlant, RelativeMotion, RotatingEllipsoid, Section

RHO = np.array([1.6, 1.632, 1.75, 1.9, 2.1, 2.2, 2.3])
TAU = np.array([4.32157, 3.06311, 2.59471, 3.10656, 3.83577, 4.05965, 4.21213])


def test_returns_of_the_orbits_about_eros() -> None:
    """To x = 0 with y > 0; ρ = 1.6 falls into the centre later."""
    starts = np.stack([0 * RHO, 1 + 0 * RHO, RHO, 0 * RHO], axis=1)
    np.testing.assert_allclose(first_return(RotatingEllipsoid(), starts), TAU, rtol=0, atol=6e-6)
    assert first_return(RotatingEllipsoid(), starts[3]) == pytest.approx(TAU[3], abs=6e-6)


def test_an_oscillator_returns_after_its_period() -> None:
    """ξ'' = -4ξ; to ξ = 0.3 with ξ' > 0 once in π, from off the section sooner."""
    section = Section(lambda t, x: x[:, 0] - 0.3, lambda t, x: x[:, 1])
    states = np.array([[0.3, 1.0], [0.0, 2.0], [-1.0, 0.0], [0.3, -1.0]])
    phase = np.arctan2(states[:, 0], 0.5 * states[:, 1])
    size = np.hypot(states[:, 0], 0.5 * states[:, 1])
    wait = np.mod(np.arcsin(0.3 / size) - phase, 2.0 * np.pi) / 2.0
    exact = np.where(wait < 1e-12, np.pi, wait)
    np.testing.assert_allclose(first_return(LinearPlant(-4.0), states, section), exact, rtol=0, atol=1e-12)


def test_no_return_is_one_sentence() -> None:
    starts = [[0.0, 1.0, 1.9, 0.0], [0.0, 1.0, 6.0, 0.0]]
    with pytest.raises(ArgumentError, match=r"must return to the section; member 1 does not before it ends at .*escap"):
        first_return(RotatingEllipsoid(), starts)
    with pytest.raises(ArgumentError, match="member 0 does not until the horizon 2"):
        first_return(RotatingEllipsoid(), starts[0], horizon=2.0)
    with pytest.raises(UnsupportedError, match="Libration has no section of its own; give `section`"):
        first_return(Libration(), [0.0, 1.0])


@pytest.mark.parametrize("plant", [Libration(), RelativeMotion(eccentricity=0.1), HCW()])
def test_periods(plant: Libration) -> None:
    assert natural_period(plant) == 2.0 * np.pi


@pytest.mark.parametrize("plant", [RotatingEllipsoid(), FunctionPlant(lambda t, x, u: -x, 1, 1)])
def test_a_plant_without_a_period_says_so(plant: FunctionPlant) -> None:
    with pytest.raises(UnsupportedError, match="has no period of its own; use `first_return`, or give a delay"):
        natural_period(plant)
