"""Families of periodic orbits against the pendulum's elliptic integrals, and about Eros."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from fracctl.errors import ArgumentError
from fracctl.plants import FunctionPlant, Libration, RotatingEllipsoid
from fracctl.stability import PeriodicOrbit, family, shoot_on_section


def slopes(t: np.ndarray, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    state, control = np.zeros((len(x), 2, 2)), np.zeros((len(x), 2, 1))
    state[:, 0, 1] = control[:, 1, 0] = 1.0
    state[:, 1, 0] = -np.cos(x[:, 0])
    return state, control


PENDULUM = FunctionPlant(
    lambda t, x, u: np.stack([x[:, 1], u[:, 0] - np.sin(x[:, 0])], 1), 2, 1, ("x", "x_dot"), jacobians=slopes
)


def energy(x: np.ndarray) -> np.ndarray:
    return 0.5 * x[..., 1] ** 2 - np.cos(x[..., 0])


def period(amplitude: float) -> float:
    return 4.0 * float(ellipk(np.sin(0.5 * amplitude) ** 2))


def swing() -> PeriodicOrbit:
    return shoot_on_section(PENDULUM, [1.0, 0.0], 6.5, "x_dot", "x", 1.0)


def test_the_period_of_a_pendulum_is_found() -> None:
    """With and without a section; without a parameter an orbit near the guess is found."""
    assert swing().period == pytest.approx(period(1.0), abs=1e-11)
    near = shoot_on_section(PENDULUM, [0.9, 0.3], 6.5)
    assert near.period == pytest.approx(period(np.arccos(-energy(near.state))), abs=1e-10)
    assert np.linalg.norm(near.state - [0.9, 0.3]) < 0.5


@pytest.mark.parametrize("parameter", ["x", "period", "energy"])
def test_a_family_of_swings(parameter: str) -> None:
    amplitudes = np.linspace(1.0, 2.2, 4)
    chosen = {"x": amplitudes, "period": [period(a) for a in amplitudes], "energy": -np.cos(amplitudes)}
    members = family(swing(), energy if parameter == "energy" else parameter, chosen[parameter], "x_dot")
    assert len(members) == 4
    for member, amplitude, value in zip(members, amplitudes, chosen[parameter], strict=True):
        assert member.value == value
        np.testing.assert_allclose(member.orbit.state, [amplitude, 0.0], atol=1e-9)
        assert member.orbit.period == pytest.approx(period(amplitude), abs=1e-9)
        np.testing.assert_allclose(member.multipliers, 1.0, atol=1e-7)
        assert member.real_above_one == 0


def test_a_family_ends_where_there_are_no_orbits() -> None:
    """Above the energy 1 the pendulum turns over; no swing is shorter than 2π, and an equilibrium is no orbit."""
    first = shoot_on_section(PENDULUM, [1.0, 0.0], 6.5, "x_dot", "x", 1.0, steps=60, tolerance=1e-8)
    members = family(first, energy, [-0.3, 1.5], "x_dot")
    assert [member.value for member in members] == [-0.3]
    with pytest.raises(ArgumentError, match="`values` must begin with one that an orbit near the given one has"):
        family(first, "period", [3.0], "x_dot")


def test_orbits_about_eros() -> None:
    """Symmetric orbits; a hyperbolic one below y = 0.62; another integrator agrees."""
    plant = RotatingEllipsoid()
    first = shoot_on_section(plant, [0.0, 0.953, 1.888, 0.0], 3.1, "x")
    members = family(first, "y", [0.95, 0.8, 0.7, 0.6], "x")
    assert [member.real_above_one for member in members] == [0, 0, 0, 1]
    assert np.all(np.abs(members[0].multipliers) < 1.0 + 1e-6)
    largest = members[-1].multipliers[0]
    assert largest.real == pytest.approx(1.0 / members[-1].multipliers[-1].real, rel=1e-6)
    for member in members:
        orbit = member.orbit
        run = solve_ivp(
            lambda t, x: plant.rates(np.array([t]), x[None], np.zeros((1, 2)))[0],
            (0.0, orbit.period),
            orbit.state,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
        )
        np.testing.assert_allclose(run.y[:, -1], orbit.state, atol=1e-9)
        np.testing.assert_allclose(orbit.state[[0, 3]], 0.0, atol=1e-9)
    constant = family(members[0].orbit, plant.jacobi_constant, [-1.5], "x")[0]
    assert plant.jacobi_constant(constant.orbit.state) == pytest.approx(-1.5, abs=1e-11)


def test_bad_input_is_refused_in_sentences() -> None:
    with pytest.raises(ArgumentError, match="`parameter` must be one of x, x_dot, period; did you mean 'period'"):
        family(swing(), "periods", [1.0])
    with pytest.raises(ArgumentError, match="`section` must be one of x, x_dot, but is 'y'"):
        family(swing(), "x", [1.0], "y")
    with pytest.raises(ArgumentError, match=r"`plant` must not depend on time.*use shoot with its period"):
        shoot_on_section(Libration(), [0.1, 0.1], 6.0)
    with pytest.raises(ArgumentError, match="`guess` must lie near an orbit of a period near 3"):
        shoot_on_section(FunctionPlant(lambda t, x, u: 1.0 + 0.0 * x, 1, 1), [0.0], 3.0)
