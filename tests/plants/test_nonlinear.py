"""The nonlinear plants against the equations as printed, integrals of motion, and two inertial Kepler orbits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fracctl.errors import ArgumentError
from fracctl.plants import (
    HCW,
    Chief,
    FunctionPlant,
    HCWInPlane,
    Libration,
    LinearPlant,
    RelativeMotion,
    RotatingEllipsoid,
    StatePlant,
    TschaunerHempel,
)

RNG_SEED = 7
PLANTS = [
    Libration(),
    RotatingEllipsoid(),
    RelativeMotion(),
    RelativeMotion(eccentricity=0.3, true_anomaly_deg=100.0),
    TschaunerHempel(eccentricity=0.3, true_anomaly_deg=100.0),
    HCWInPlane(),
    FunctionPlant(lambda t, x, u: np.sin(x) * t[:, None] + x[:, ::-1] ** 2 + u, 2, 2),
]


def some(plant: StatePlant, count: int = 5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(RNG_SEED)
    x = rng.uniform(0.3, 1.2, (count, plant.n_states)) * rng.choice([-1.0, 1.0], (count, plant.n_states))
    return rng.uniform(-9.0, 9.0, count), x, rng.normal(size=(count, plant.n_controls))


@pytest.mark.parametrize("plant", PLANTS, ids=repr)
def test_jacobians_are_the_derivatives(plant: StatePlant) -> None:
    t, x, u = some(plant)
    numeric = FunctionPlant(plant.rates, plant.n_states, plant.n_controls)
    for exact, differences in zip(plant.jacobians(t, x, u), numeric.jacobians(t, x, u), strict=True):
        np.testing.assert_allclose(exact, differences, rtol=1e-8, atol=1e-8 * np.abs(differences).max())


@pytest.mark.parametrize("plant", PLANTS, ids=repr)
def test_members_of_a_batch_do_not_meet(plant: StatePlant) -> None:
    t, x, u = some(plant)
    whole = plant.rates(t, x, u)
    for i in range(len(x)):
        np.testing.assert_array_equal(plant.rates(t[i : i + 1], x[i : i + 1], u[i : i + 1])[0], whole[i])
    assert len(plant.state_names) == plant.n_states == x.shape[1]


def test_libration_is_the_equation_as_printed() -> None:
    nu, angle, rate, control = mpmath.mpf("2.3"), mpmath.mpf("0.7"), mpmath.mpf("-1.1"), mpmath.mpf("0.25")
    e, inertia, c, gamma = (mpmath.mpf(s) for s in ("0.2", "0.75", "0.04", "0.05"))
    r = 1 + e * mpmath.cos(nu)
    second = (2 * e * mpmath.sin(nu) * (1 + rate) - inertia * mpmath.sin(2 * angle)) / r
    second += -c * rate**2 - gamma * rate / r**2 + control
    value = Libration().rates(np.array([2.3]), np.array([[0.7, -1.1]]), np.array([[0.25]]))
    np.testing.assert_allclose(value, [[-1.1, float(second)]], rtol=1e-15)


def test_ellipsoid_is_the_gradient_of_its_potential() -> None:
    def potential(x: mpmath.mpf, y: mpmath.mpf) -> mpmath.mpf:
        r = mpmath.sqrt(x * x + y * y)
        return 1 / r + r * r / 2 + 3 * mpmath.mpf("0.052") * (x * x - y * y) / r**5

    plant, (x, y, vx, vy) = RotatingEllipsoid(), (0.8, -0.6, 0.3, 0.9)
    slope = [float(mpmath.diff(potential, (x, y), n)) for n in ((1, 0), (0, 1))]
    value = plant.rates(np.zeros(1), np.array([[x, y, vx, vy]]), np.array([[0.01, -0.02]]))[0]
    np.testing.assert_allclose(value, [vx, vy, 2 * vy + slope[0] + 0.01, -2 * vx + slope[1] - 0.02], rtol=1e-13)
    assert float(plant.potential(np.array([x, y]))) == pytest.approx(float(potential(x, y)), rel=1e-14)


def test_free_motion_about_the_ellipsoid_keeps_its_integral() -> None:
    plant = RotatingEllipsoid()
    rates = plant.rates(*(v := some(plant))[:2], np.zeros((5, 2)))
    step = 1e-6
    moved = [plant.jacobi_constant(v[1] + sign * step * rates) for sign in (1.0, -1.0)]
    np.testing.assert_allclose((moved[0] - moved[1]) / (2 * step), 0.0, atol=1e-8)


def test_units_of_eros() -> None:
    """Length 15.965 km, time 0.8388 h, speed 5.287 m/s; 70 h are 83.45 units."""
    scales = RotatingEllipsoid().scales
    assert scales.length_m == pytest.approx(15965.0, abs=0.5)
    assert scales.time_s / 3600.0 == pytest.approx(0.8388, abs=5e-5)
    assert scales.speed_m_s == pytest.approx(5.287, abs=5e-4)
    assert 70.0 * 3600.0 / scales.time_s == pytest.approx(83.45, abs=5e-3)


@pytest.mark.parametrize("e", [0.0, 0.005, 0.1, 0.3])
def test_relative_motion_is_the_difference_of_two_kepler_orbits(e: float) -> None:
    """To 1e-9 km over three orbits, in the turning frame; starts 2 and 20 km away with a drift."""
    plant = RelativeMotion(Chief(6700.0, gravitational_parameter_km3_s2=398600.5), e)
    length = plant.scales.length_m / 1e3
    start = np.array([20.0, -2.0, 5.0, 0.0, -30.0, 4.0]) / length
    times = np.linspace(0.0, 6.0 * np.pi, 13)

    def free(t: float, x: np.ndarray) -> np.ndarray:
        return plant.rates(np.array([t]), x[None], np.zeros((1, 3)))[0]

    run = solve_ivp(free, (0.0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-17)
    r0, omega0 = 1.0 - e, np.sqrt(1.0 - e * e) / (1.0 - e) ** 2
    place = np.array([r0, 0.0, 0.0]) + start[:3]
    speed = np.array([0.0, omega0 * r0, 0.0]) + start[3:] + omega0 * np.array([-start[1], start[0], 0.0])
    with mpmath.workdps(30):
        for i, t in enumerate(times):
            leader = kepler([r0, 0.0, 0.0], [0.0, omega0 * r0, 0.0], t)
            gap = [b - a for a, b in zip(leader, kepler(place, speed, t), strict=True)]
            angle = mpmath.atan2(leader[1], leader[0])
            c, s = mpmath.cos(angle), mpmath.sin(angle)
            turned = [c * gap[0] + s * gap[1], c * gap[1] - s * gap[0], gap[2]]
            np.testing.assert_allclose(run.y[:3, i] * length, [float(v) * length for v in turned], rtol=0, atol=1e-9)


def kepler(place: np.ndarray, speed: np.ndarray, time: float) -> list[mpmath.mpf]:
    """The two-body orbit with GM = 1 by Lagrange's f and g and Kepler's equation in the eccentric anomaly."""
    x, v = [mpmath.mpf(float(c)) for c in place], [mpmath.mpf(float(c)) for c in speed]
    r = mpmath.sqrt(sum(c * c for c in x))
    a = 1 / (2 / r - sum(c * c for c in v))
    n, sigma = a ** mpmath.mpf("-1.5"), sum(p * q for p, q in zip(x, v, strict=True)) / mpmath.sqrt(a)
    change = n * time

    def excess(d: mpmath.mpf) -> mpmath.mpf:
        return d - (1 - r / a) * mpmath.sin(d) + sigma * (1 - mpmath.cos(d)) - change

    d = mpmath.findroot(excess, change)
    f, g = 1 - a / r * (1 - mpmath.cos(d)), time + (mpmath.sin(d) - d) / n
    return [f * p + g * q for p, q in zip(x, v, strict=True)]


def test_near_the_leader_relative_motion_is_that_of_hill() -> None:
    t, x, u = np.zeros(1), np.zeros((1, 6)), np.zeros((1, 3))
    for near, linear in zip(RelativeMotion().jacobians(t, x, u), HCW().jacobians(t, x, u), strict=True):
        np.testing.assert_allclose(near, linear, atol=1e-15)
    tiny = np.full((1, 6), 1e-12)
    np.testing.assert_allclose(RelativeMotion().rates(t, tiny, u), HCW().rates(t, tiny, u), rtol=1e-10)


def test_leader_keeps_to_keplers_equation() -> None:
    """At times of high eccentricity, too: t = E - e sin E, r = 1 - e cos E, ω r² = √(1 - e²)."""
    anomaly = np.linspace(-20.0, 20.0, 41)
    for e in (0.0, 0.4, 0.95):
        r, omega, omega_dot = RelativeMotion(eccentricity=e).leader_motion(anomaly - e * np.sin(anomaly)).T
        np.testing.assert_allclose(r, 1.0 - e * np.cos(anomaly), rtol=1e-12)
        np.testing.assert_allclose(omega * r**2, np.sqrt(1.0 - e * e), rtol=1e-14)
        np.testing.assert_allclose(omega_dot, -2.0 * e * np.sin(anomaly) / r * omega / r, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Libration(eccentricity=1.0), r"`eccentricity` must lie in \[0, 1\)"),
        (lambda: Libration(inertia=np.nan), "`inertia` must be a finite number"),
        (lambda: RelativeMotion(eccentricity=-0.1), r"`eccentricity` must lie in \[0, 1\)"),
        (lambda: RotatingEllipsoid(rotation_period_h=0.0), "`rotation_period_h` must be positive"),
        (lambda: RotatingEllipsoid(collision="surface"), "`collision` must be 'point' or 'body', but is 'surface'"),
        (lambda: RotatingEllipsoid(semi_axes_km=(1.0,)), "`semi_axes_km` must be two numbers"),
        (lambda: FunctionPlant(lambda t, x, u: x, 0, 1), "`n_states` must be a whole number above 0"),
        (lambda: FunctionPlant(lambda t, x, u: x, 2, 1, ("a", "a")), "`state_names` must be 2 different names"),
    ],
)
def test_plants_refuse_in_sentences(make: object, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()


def test_a_function_of_a_wrong_shape_is_refused_when_it_is_called() -> None:
    plant = FunctionPlant(lambda t, x, u: x[:, 0], 2, 1)
    with pytest.raises(ArgumentError, match=r"`f` must return the shape of its x, \(b, 2\), here \(3, 2\)"):
        plant.rates(np.zeros(3), np.zeros((3, 2)), np.zeros((3, 1)))


def test_linear_plants_have_a_state_form() -> None:
    plant = LinearPlant(-4.0, -0.1)
    np.testing.assert_allclose(plant.rates(np.zeros(1), np.array([[1.0, 2.0]]), np.array([[0.5]])), [[2.0, -3.7]])
    assert plant.n_states == 2
    assert plant.events == ()
