"""The tether against Lagrange's equations of the paper's energies, its rest state, its integral and its units."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad

from fracctl.controllers import Saturation
from fracctl.errors import ArgumentError
from fracctl.plants import FunctionPlant, StatePlant, Tether

E = (0.0, 0.0027, 0.17)


def some(count: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(11)
    x = rng.uniform(0.3, 1.2, (count, 6)) * rng.choice([-1.0, 1.0], (count, 6))
    x[:, 0] = np.abs(x[:, 0])
    return rng.uniform(-9.0, 9.0, count), x, rng.normal(size=(count, 3))


def lagrange() -> Callable[..., np.ndarray]:
    """ξ'' of f, e, q, q' and forces over m̄ ḟ² (L, L², L²), of the energies (1) and (2) by f instead of t."""
    f, e, omega, p, mass, full = sp.symbols("f e Omega p m L", positive=True)
    q, v, a, w, u = (sp.symbols(f"{name}1:4") for name in "qvawu")
    rate, radius = sp.symbols("F R")
    length, theta, phi = full * q[0], q[1], q[2]
    kinetic = mass / 2 * (full**2 * w[0] ** 2 + length**2 * (w[2] ** 2 + (w[1] + rate) ** 2 * sp.cos(phi) ** 2))
    gravity = omega**2 * p**3 * mass * length**2 / (2 * radius**3)
    lagrangian = kinetic - gravity * (1 - 3 * sp.cos(theta) ** 2 * sp.cos(phi) ** 2)
    k = 1 + e * sp.cos(f)
    along = {rate: omega * k**2, radius: p / k} | {w[i]: omega * k**2 * v[i] for i in range(3)}
    equations = []
    for i in range(3):
        momentum = sp.diff(lagrangian, w[i]).subs(along)
        change = sp.diff(momentum, f) + sum(
            sp.diff(momentum, q[j]) * v[j] + sp.diff(momentum, v[j]) * a[j] for j in range(3)
        )
        force = mass * (omega * k**2) ** 2 * full**2 * u[i]
        equations.append(omega * k**2 * change - sp.diff(lagrangian, q[i]).subs(along) - force)
    solution = sp.solve(equations, a, dict=True)[0]
    some_units = {omega: 1.3, p: 0.7, mass: 2.1, full: 1.9}
    return sp.lambdify((f, e, *q, *v, *u), [solution[x].subs(some_units) for x in a], "mpmath")


@pytest.mark.parametrize("e", E)
def test_accelerations_are_those_of_lagranges_equations(e: float) -> None:
    plant, exact = Tether(e, disturbance=(0.1, -0.2, 0.3), disturbance_phase=0.6), lagrange()
    t, x, u = some()
    rates = plant.rates(t, x, u)
    np.testing.assert_array_equal(rates[:, :3], x[:, 3:])
    for i in range(len(t)):
        force = u[i] + np.array([0.1, -0.2, 0.3]) * math.sin(t[i] + 0.6) - [plant.rho, 0.0, 0.0]
        expected = [float(value) for value in exact(t[i], e, *x[i], *force)]
        np.testing.assert_allclose(rates[i, 3:], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_acceleration_that_is_handed_over_is_that_of_the_rates() -> None:
    plant, (t, x, u) = Tether(0.17), some()
    for i in range(len(t)):
        out = np.empty(3)
        plant.acceleration(t[i], x[i, :3].copy(), x[i, 3:].copy(), u[i], plant.kernel_parameters(1)[0], out)
        np.testing.assert_array_equal(out, plant.rates(t, x, u)[i, 3:])


@pytest.mark.parametrize("e", E)
def test_jacobians_are_the_derivatives(e: float) -> None:
    plant, (t, x, u) = Tether(e, disturbance_phase=1.1), some()
    numeric = FunctionPlant(plant.rates, 6, 3)
    for exact, differences in zip(plant.jacobians(t, x, u), numeric.jacobians(t, x, u), strict=True):
        np.testing.assert_allclose(exact, differences, rtol=1e-8, atol=1e-8 * np.abs(differences).max())


def test_at_rest_the_tension_is_one_and_two_over_k() -> None:
    """Along the vertical at full length; on an ellipse a torque -b keeps the angle from the orbit's uneven rate."""
    for e in E:
        plant, f = Tether(e, disturbance=(0.0, 0.0, 0.0)), np.linspace(0.0, 6.0, 7)
        k = 1.0 + e * np.cos(f)
        u = np.stack([plant.rho - 1.0 - 2.0 / k, -2.0 * e * np.sin(f) / k, 0.0 * f], axis=1)
        rest = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], (7, 1))
        np.testing.assert_allclose(plant.rates(f, rest, u), 0.0, atol=1e-14)


def test_constant_tension_on_a_circular_orbit_keeps_an_integral() -> None:
    plant, tension = Tether(0.0, disturbance=(0.0, 0.0, 0.0)), 0.8
    _, x, _ = some()
    u = np.tile([plant.rho - tension, 0.0, 0.0], (len(x), 1))

    def integral(x: np.ndarray) -> np.ndarray:
        length, theta, phi, length_rate, theta_rate, phi_rate = x.T
        kinetic = length_rate**2 + length**2 * (phi_rate**2 + (theta_rate**2 - 1.0) * np.cos(phi) ** 2)
        return (kinetic + length**2 * (1.0 - 3.0 * (np.cos(theta) * np.cos(phi)) ** 2)) / 2.0 + tension * length

    step, rates = 1e-6, plant.rates(np.zeros(len(x)), x, u)
    np.testing.assert_allclose(integral(x + step * rates), integral(x - step * rates), rtol=0, atol=1e-11)


def test_disturbances_are_sines_of_their_own_phase() -> None:
    t, x, u = some(2)
    calm = Tether(disturbance=(0.0, 0.0, 0.0))
    plant = Tether(disturbance=[[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], disturbance_phase=[0.0, 0.7])
    added = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]) * np.sin(t + np.array([0.0, 0.7]))[:, None]
    np.testing.assert_allclose(plant.rates(t, x, u), calm.rates(t, x, u + added), rtol=1e-13)
    np.testing.assert_array_equal(plant.kernel_parameters(2)[:, 1], 2.55)
    assert Tether(disturbance_phase=[0.0, 0.1]).kernel_parameters(2).shape == (2, 6)
    with pytest.raises(ArgumentError, match="`x` must have a row for each member of the plant, 2, but is a batch of 3"):
        plant.kernel_parameters(3)


def test_units_of_the_orbit_that_the_paper_names() -> None:
    """ḟ = 1.17e-3 rad/s at a perigee of 249 km; 2.58 m/s over 3500 m is λ' = 0.629 there, and 0.589 for case 2."""
    plant, eccentric = Tether(), Tether(0.17, perigee_altitude_km=300.0)
    assert float(plant.rate_rad_s(0.0)) == pytest.approx(1.17e-3, abs=5e-6)
    assert 2.58 / 3500.0 / float(plant.rate_rad_s(0.0)) == pytest.approx(0.629, abs=5e-4)
    assert 2.58 / 3500.0 / float(eccentric.rate_rad_s(0.0)) == pytest.approx(0.589, abs=5e-4)
    assert plant.orbital_period_s == pytest.approx(2.0 * math.pi * math.sqrt(6645.08**3 / 398600.4418), rel=1e-5)
    for f in (0.4, 3.0, math.pi, 5.0, 9.0):
        seconds, _ = quad(lambda a: 1.0 / float(eccentric.rate_rad_s(a)), 0.0, f, epsabs=1e-9)
        assert float(eccentric.orbits(f)) == pytest.approx(seconds / eccentric.orbital_period_s, rel=1e-12)
    assert float(eccentric.orbits(-1.0)) == pytest.approx(-float(eccentric.orbits(1.0)))


def test_forces_in_newton() -> None:
    """The tension that holds a subsatellite still is 3 m̄ n² l; a torque is a force on its arm."""
    plant, length = Tether(0.0), 0.4
    n, mass = float(plant.rate_rad_s(0.0)), 6530.0 * 12.0 / 6542.0
    held = np.array([[plant.rho - 3.0 * length, 0.2, -0.3]])
    x = np.array([[length, 0.1, 0.5, 0.0, 0.0, 0.0]])
    np.testing.assert_allclose(plant.tension_n(0.7, held), 3.0 * mass * n**2 * length * 3500.0, rtol=1e-14)
    torques = mass * n**2 * 3500.0**2 * np.array([0.2, -0.3])
    np.testing.assert_allclose(plant.torques_n_m(0.7, held), [torques], rtol=1e-14)
    arms = np.array([length * 3500.0 * math.cos(0.5), length * 3500.0])
    np.testing.assert_allclose(plant.thruster_force_n(0.7, x, held), [torques / arms], rtol=1e-14)
    later = Tether(0.17)
    u = np.tile(held, (2, 1))
    ratio = np.divide(*later.tension_n(np.array([0.0, math.pi]), u))
    assert ratio == pytest.approx((1.17 / 0.83) ** 4, rel=1e-12)


def test_runs_end_where_the_satellites_meet_and_where_there_is_no_more_tether() -> None:
    plant = Tether(shortest=0.01, longest=1.5)
    x = np.zeros((4, 6))
    x[:, 0] = 0.009, 0.011, 1.49, 1.51
    collision, escaped = plant.events
    assert (collision.name, collision.terminal) == ("collision", True)
    assert (escaped.name, escaped.terminal) == ("escaped", True)
    np.testing.assert_array_equal(np.sign(collision.function(np.zeros(4), x)), [-1.0, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(np.sign(escaped.function(np.zeros(4), x)), [1.0, 1.0, 1.0, -1.0])


def test_limits_are_those_of_a_saturation_by_axis() -> None:
    plant = Tether(tension=(0.1, 5.0), torque=0.5)
    assert plant.rho == pytest.approx(2.55)
    clipped = Saturation(plant.limits, "axis")(np.array([[9.0, -9.0, 0.4], [-9.0, 0.1, 9.0]]))
    np.testing.assert_allclose(clipped, [[2.45, -0.5, 0.4], [-2.45, 0.1, 0.5]])
    np.testing.assert_allclose(plant.rho - clipped[:, 0], [0.1, 5.0])


def test_the_tether_is_a_plant_in_the_true_anomaly() -> None:
    plant = Tether()
    assert isinstance(plant, StatePlant)
    assert plant.state_names == ("length", "theta", "phi", "length_dot", "theta_dot", "phi_dot")
    assert (plant.angles, plant.period, plant.scales) == (("theta", "phi"), 2.0 * math.pi, None)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Tether(1.0), r"`eccentricity` must lie in \[0, 1\)"),
        (lambda: Tether(length_m=0.0), "`length_m` must be positive"),
        (lambda: Tether(shortest=math.inf), "`shortest` must hold finite numbers only"),
        (lambda: Tether(tension=(5.0, 0.1)), "`tension` must be two numbers, 0 <= least < largest"),
        (lambda: Tether(tension=(1.0,)), "`tension` must be two numbers"),
        (lambda: Tether(disturbance=0.1), r"`disturbance` must have shape \(3,\) or \(b, 3\), but is of shape \(\)"),
        (lambda: Tether(disturbance_phase=[[0.0]]), r"`disturbance_phase` must have shape \(\) or \(b,\)"),
        (lambda: Tether(disturbance=np.ones((2, 3)), disturbance_phase=[0.0] * 3), "must have the same batch size"),
    ],
)
def test_tethers_refuse_in_sentences(make: Callable[[], Tether], sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()
