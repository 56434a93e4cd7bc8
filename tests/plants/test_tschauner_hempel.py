"""The Tschauner-Hempel plant against HCW, Yamanaka and Ankersen's closed form, and the nonlinear motion."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fracctl as fc
from fracctl.errors import ArgumentError
from fracctl.plants import HCW, PerturbedRelativeMotion, RelativeMotion, TschaunerHempel
from tests.references.tschauner_hempel import transition

PHASES = [(0.0, 0.0), (0.1, 0.0), (0.1, 130.0), (0.7, -50.0)]


def test_on_a_circular_orbit_it_is_hill() -> None:
    rng = np.random.default_rng(1)
    t, x, u = rng.uniform(0.0, 30.0, 20), rng.normal(size=(20, 6)), rng.normal(size=(20, 3))
    np.testing.assert_allclose(TschaunerHempel().rates(t, x, u), HCW().rates(t, x, u), rtol=1e-15, atol=2e-15)
    for mine, hill in zip(TschaunerHempel().jacobians(t, x, u), HCW().jacobians(t, x, u), strict=True):
        np.testing.assert_array_equal(mine, hill)


@pytest.mark.parametrize(("e", "phase"), PHASES)
def test_free_motion_is_the_closed_form(e: float, phase: float) -> None:
    """Of Yamanaka and Ankersen (2002), over one and a half orbits; the closed form solves the equations, too."""
    plant, time = TschaunerHempel(eccentricity=e, true_anomaly_deg=phase), 3.0 * np.pi
    exact = transition(e, np.radians(phase), time)

    def free(t: float, x: np.ndarray) -> np.ndarray:
        matrix = plant.jacobians(np.array([t]), np.zeros((1, 6)), np.zeros((1, 3)))[0][0]
        return (matrix @ x.reshape(6, 6)).ravel()

    run = solve_ivp(free, (0.0, time), np.eye(6).ravel(), "DOP853", rtol=3e-14, atol=1e-14)
    np.testing.assert_allclose(run.y[:, -1].reshape(6, 6), exact, rtol=0, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize(("e", "phase"), PHASES)
def test_the_closed_form_solves_the_equations(e: float, phase: float) -> None:
    """Its derivative is ∂f/∂x times itself, to 1e-12, with no integrator between."""
    plant = TschaunerHempel(eccentricity=e, true_anomaly_deg=phase)
    for time in (0.3, 2.0, 5.0):
        with mpmath.workdps(40):
            h, now = mpmath.mpf("1e-10"), mpmath.mpf(time)
            after, before = (transition(e, np.radians(phase), t, digits=40) for t in (now + h, now - h))
            slope = ((after - before) / (2 * h)).astype(float)
        matrix = plant.jacobians(np.array([time]), np.zeros((1, 6)), np.zeros((1, 3)))[0][0]
        expected = matrix @ transition(e, np.radians(phase), time)
        np.testing.assert_allclose(slope, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(("e", "phase"), PHASES)
def test_it_is_the_linearisation_of_the_nonlinear_motion(e: float, phase: float) -> None:
    rng = np.random.default_rng(2)
    t, x, u = rng.uniform(0.0, 9.0, 5), np.zeros((5, 6)), np.zeros((5, 3))
    plant = TschaunerHempel(eccentricity=e, true_anomaly_deg=phase)
    for others in (RelativeMotion, PerturbedRelativeMotion):
        more = {} if others is RelativeMotion else {"j2": 0.0}
        near = others(eccentricity=e, true_anomaly_deg=phase, **more)
        tolerance = 1e-12 if others is RelativeMotion else 1e-8
        for mine, nonlinear in zip(plant.jacobians(t, x, u), near.jacobians(t, x, u), strict=True):
            np.testing.assert_allclose(mine, nonlinear, rtol=tolerance, atol=tolerance * np.abs(nonlinear).max())


def test_a_phase_is_a_later_time() -> None:
    """True anomaly 60° at e = 0.2: M = E - e sin E with tan(E/2) = √((1-e)/(1+e)) tan 30°."""
    eccentric = 2.0 * np.arctan(np.sqrt(0.8 / 1.2) * np.tan(np.radians(30.0)))
    t = np.array([0.0, 1.0, 7.0])
    for make in (TschaunerHempel, RelativeMotion):
        shifted = make(eccentricity=0.2, true_anomaly_deg=60.0).leader_motion(t)
        later = make(eccentricity=0.2).leader_motion(t + eccentric - 0.2 * np.sin(eccentric))
        np.testing.assert_allclose(shifted, later, rtol=1e-14)


def test_the_fractional_law_flies_on_it() -> None:
    """At e = 0 as on HCW by another solver; near the leader as on the nonlinear motion, with the distance's order."""
    law = fc.controllers.PDAlpha(
        k_p=[[4.1, -1.55, 0.0], [3.15, 0.9, 0.0], [0.0, 0.0, 0.85]],
        k_d=[[2.7, 1.05, 0.0], [0.9, 2.05, 0.0], [0.0, 0.0, 2.0]],
        alpha=[0.98, 0.90, 0.91],
    )
    start, times = np.array([-1e-3, 0.0, 0.0, 0.0, 2e-3, 2e-3]), np.linspace(0.0, 2.0 * np.pi, 40)

    def flown(plant: object, factor: float = 1.0, solver: str = "explicit_memory") -> np.ndarray:
        loop = fc.ClosedLoop(plant, law)
        return fc.solve(loop, factor * start, 2.0 * np.pi, solver=solver, tolerance=1e-10)(times) / factor

    hill = flown(HCW(), solver="contour")
    np.testing.assert_allclose(flown(TschaunerHempel()), hill, atol=1e-9 * np.abs(hill).max())
    elliptic = TschaunerHempel(eccentricity=0.1, true_anomaly_deg=40.0)
    nonlinear = RelativeMotion(eccentricity=0.1, true_anomaly_deg=40.0)
    linear = flown(elliptic)
    gaps = [np.abs(flown(nonlinear, factor) - linear).max() for factor in (1.0, 0.1)]
    assert gaps[0] > 1e-6 * np.abs(linear).max()
    assert gaps[0] / gaps[1] == pytest.approx(10.0, rel=0.02)


def test_bad_orbits_are_refused_in_sentences() -> None:
    with pytest.raises(ArgumentError, match=r"`eccentricity` must lie in \[0, 1\)"):
        TschaunerHempel(eccentricity=1.0)
    with pytest.raises(ArgumentError, match="`true_anomaly_deg` must be a finite number"):
        TschaunerHempel(true_anomaly_deg=np.nan)
