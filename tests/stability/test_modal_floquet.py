"""Multipliers of periodic loops with memory against exact poles, integer-order monodromy, and flown growth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import fracctl as fc
from fracctl.controllers.linear import LinearLawTerms
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.terms import FractionalTerm
from fracctl.measures.floquet_multiplier import FloquetMultiplier
from fracctl.plants import HCW, HCWOutOfPlane, LinearPlant, TschaunerHempel
from fracctl.stability import memory_multipliers

TURN = 2.0 * np.pi
SLOW = fc.controllers.PDAlpha(k_p=0.5 * np.eye(3), k_d=0.3 * np.eye(3), alpha=0.6)
"""Too weak for the radial direction: one real multiplier far outside."""
FAST = fc.controllers.PDAlpha(
    k_p=[[4.1, -1.55, 0.0], [3.15, 0.9, 0.0], [0.0, 0.0, 0.85]],
    k_d=[[2.7, 1.05, 0.0], [0.9, 2.05, 0.0], [0.0, 0.0, 2.0]],
    alpha=[0.98, 0.90, 0.91],
)


def errors(loop: fc.ClosedLoop, kernel_tolerance: float) -> np.ndarray:
    """Relative distances of the multipliers of the exact poles to the nearest computed ones."""
    exact = np.exp(TURN * fc.stability.assess(loop).poles)
    found = memory_multipliers(loop, kernel_tolerance=kernel_tolerance).values
    return np.abs(found - exact[:, None]).min(axis=1) / np.abs(exact)


def test_on_a_circular_orbit_they_tend_to_those_of_the_exact_poles() -> None:
    """IC1's fastest law out of plane, poles -1.116 ± 1.221i: the error falls with the number of modes.

    kernel error   modes   relative error of the multiplier
    1e-2           18      7.7e-2
    1e-4           31      6.0e-3
    1e-6           44      4.7e-4
    1e-8           60      3.5e-5
    """
    loop = fc.ClosedLoop(HCWOutOfPlane(), fc.controllers.PDAlpha(k_p=0.85, k_d=2.0, alpha=0.91))
    table = [errors(loop, tolerance).max() for tolerance in (1e-2, 1e-4, 1e-6, 1e-8)]
    np.testing.assert_allclose(table, [7.7e-2, 6.0e-3, 4.7e-4, 3.5e-5], rtol=0.1)
    found = memory_multipliers(loop, kernel_tolerance=1e-8)
    assert found.stable
    assert found.largest == pytest.approx(np.exp(-1.11552618 * TURN), rel=1e-4)
    assert found.largest < found.slowest_relaxation < 1.0, "the tail, not the poles, is what settles last"
    assert np.count_nonzero(found.isolated) == 2


def test_poles_far_from_the_cut_are_there_with_few_modes() -> None:
    loop = fc.ClosedLoop(HCW(), SLOW)
    assert errors(loop, 1e-6).max() < 2e-6
    found = memory_multipliers(loop)
    assert not found.stable
    assert found.largest == pytest.approx(np.exp(TURN * fc.stability.assess(loop).poles[0].real), rel=1e-7)


@pytest.mark.parametrize("alpha", [1.0, 0.999999])
def test_integer_orders_have_the_multipliers_of_the_monodromy_matrix(alpha: float) -> None:
    """Of PD at e = 0.2, by an integrator; no modes are needed, and orders next to 1 are no limit."""
    plant = TschaunerHempel(eccentricity=0.2, true_anomaly_deg=30.0)
    law = fc.controllers.PDAlpha(k_p=FAST.k_p, k_d=0.1 * FAST.k_d, alpha=alpha)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        x = y.reshape(6, 6)
        state, control = (part[0] for part in plant.jacobians(np.array([t]), np.zeros((1, 6)), np.zeros((1, 3))))
        return (state @ x - control @ (law.k_p @ x[:3] + law.k_d @ x[3:])).ravel()

    run = solve_ivp(rates, (0.0, TURN), np.eye(6).ravel(), "DOP853", rtol=1e-12, atol=1e-14)
    expected = np.linalg.eigvals(run.y[:, -1].reshape(6, 6))
    found = memory_multipliers(fc.ClosedLoop(plant, law))
    assert found.modes == 0 or alpha < 1.0
    distances = np.abs(found.values - expected[:, None]).min(axis=1)
    assert distances.max() < (2e-7 if alpha == 1.0 else 1e-4)


def test_a_growing_motion_grows_by_the_largest() -> None:
    """At e = 0.1: from orbit to orbit the state of an unstable loop, flown by the memory solver, grows by μ."""
    loop = fc.ClosedLoop(TschaunerHempel(eccentricity=0.1), SLOW)
    found = memory_multipliers(loop)
    flown = fc.solve(loop, [1e-3, 0, 0, 0, 0, 0], 4.0 * TURN, solver="explicit_memory", tolerance=1e-9)
    places = flown(TURN * np.arange(2.0, 5.0))[:, 0]
    assert not found.stable
    assert places[2] / places[1] == pytest.approx(found.largest, rel=1e-5)


def test_a_stable_loop_on_an_elliptic_orbit() -> None:
    found = memory_multipliers(fc.ClosedLoop(TschaunerHempel(eccentricity=0.1), FAST))
    assert found.stable
    assert found.largest < 0.05
    assert 0.99 < found.slowest_relaxation < 1.0


def test_laws_with_integrals_and_lags() -> None:
    """PI^λ D^μ and a lag: multipliers of the exact poles again."""
    for law in (
        fc.controllers.PILambdaDMu(k_p=0.8, k_i=0.4, k_d=0.5, integral_order=0.5, derivative_order=0.7),
        fc.controllers.PDLag(k_p=0.8, k_d=0.5, time_constant=0.4),
    ):
        loop = fc.ClosedLoop(HCWOutOfPlane(), law)
        exact = np.exp(TURN * fc.stability.assess(loop).poles[:2])
        found = memory_multipliers(loop, kernel_tolerance=1e-10).values
        assert (np.abs(found - exact[:, None]).min(axis=1) < 1e-4 * np.abs(exact)).all()


def meissner(lead: float = 0.0, level: float = 0.0) -> fc.ClosedLoop:
    """x'' + 0.1 x' + (0.5 + 0.4 sign(cos(t + lead) - level)) x = 0: a spring that is stiff and soft by turns."""

    def rates(t: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        spring = 0.4 * np.sign(np.cos(t + lead) - level)
        return np.stack([x[:, 1], -spring * x[:, 0] + u[:, 0]], axis=1)

    law = fc.controllers.PDAlpha(k_p=0.5, k_d=0.1, alpha=1.0)
    return fc.ClosedLoop(fc.plants.FunctionPlant(rates, n_states=2, n_controls=1), law)


def exact_meissner(level: float) -> np.ndarray:
    """Multipliers from a product of matrix exponentials over the two parts of the period."""
    stiff, soft = (np.array([[0.0, 1.0], [-spring, -0.1]]) for spring in (0.9, 0.1))
    share = 2.0 * np.arccos(level)
    return np.linalg.eigvals(expm(share * stiff) @ expm((TURN - share) * soft))


def test_coefficients_that_are_constant_at_first_only() -> None:
    """Meissner's equation, with jumps at quarters of the period."""
    found = memory_multipliers(meissner(), period=TURN)
    assert np.abs(found.values - exact_meissner(0.0)[:, None]).min(axis=1).max() < 1e-8
    assert (found.stable, found.converged) == (True, True)
    assert found.gap < 1e-7


def test_multipliers_that_have_not_converged_decide_nothing() -> None:
    """With jumps within steps the error falls only as the steps, and at 64 they change nothing by chance."""
    loop, exact = meissner(0.1, 0.3), exact_meissner(0.3)
    found = memory_multipliers(loop, period=TURN)
    assert (found.stable, found.converged, found.steps) == (None, False, 1024)
    assert 1e-7 < np.abs(found.values - exact[:, None]).min(axis=1).max() < found.gap < 2e-2
    assert memory_multipliers(loop, period=TURN, tolerance=2e-2).stable is False


def test_a_loop_with_periodic_coefficients_is_judged_by_its_multipliers() -> None:
    for law, stable in ((FAST, True), (SLOW, False)):
        loop = fc.ClosedLoop(TschaunerHempel(eccentricity=0.1), law)
        verdict, found = fc.stability.assess(loop), memory_multipliers(loop)
        assert verdict.stable is stable
        assert np.exp(TURN * verdict.poles[0].real) == pytest.approx(found.largest)
        assert "Floquet" in verdict.method
    with pytest.raises(
        UnsupportedError, match=r"constant coefficients is asked for, .* with periodic coefficients and"
    ):
        loop.system  # noqa: B018


def test_a_circular_orbit_has_the_verdict_of_the_poles() -> None:
    for law in (FAST, SLOW):
        about = fc.stability.assess(fc.ClosedLoop(TschaunerHempel(), law))
        assert about.stable is fc.stability.assess(fc.ClosedLoop(HCW(), law)).stable


def test_the_measure_takes_the_members_of_a_batch() -> None:
    gains = [0.3, 1.0]
    eye = np.eye(3)
    plant = TschaunerHempel(eccentricity=0.1)
    batch = fc.controllers.PDAlpha(np.multiply.outer(gains, 3.0 * eye), np.multiply.outer(gains, 2.0 * eye), [0.9] * 3)
    found = FloquetMultiplier().of_loop(fc.ClosedLoop(plant, batch))["floquet_multiplier"]
    singles = [fc.controllers.PDAlpha(3.0 * g * eye, 2.0 * g * eye, [0.9] * 3) for g in gains]
    expected = [memory_multipliers(fc.ClosedLoop(plant, law), kernel_tolerance=1e-4).largest for law in singles]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert found[0] != pytest.approx(found[1])


def test_a_run_has_the_verdict_in_its_rows_and_keeps_to_a_limit(tmp_path: Path) -> None:
    words = [
        *("plant=tschauner_hempel", "evaluation.largest_control=null", "figures=null", "horizon_periods=2"),
        *(f"output_dir={tmp_path}", "+measures.floquet_multiplier={kernel_tolerance: 0.01}"),
    ]
    row = fc.run("elliptic_ic1", [*words, "constraints.floquet_multiplier='<= 0.5'"]).evaluations.iloc[0]
    assert (bool(row["stable"]), row["status"]) == (True, "ok")
    assert 0.0 < row["floquet_multiplier"] < 0.5
    tight = fc.run("elliptic_ic1", [*words, "constraints.floquet_multiplier='<= 1e-9'"]).evaluations
    assert tight["status"].tolist() == ["beyond_limits"]
    away = fc.run("elliptic_ic1", [*words, *(f"controller.k_p_{axis}=-1" for axis in "xyz")]).evaluations.iloc[0]
    assert away["floquet_multiplier"] > 1.0
    assert (bool(away["stable"]), away["status"]) == (False, "unstable")


def test_what_is_refused() -> None:
    batch = fc.ClosedLoop(HCWOutOfPlane(), fc.controllers.PDAlpha(k_p=[0.1, 0.2], k_d=1.0, alpha=0.9))
    with pytest.raises(ArgumentError, match="`loop` must be a single loop"):
        memory_multipliers(batch)
    timeless = fc.ClosedLoop(LinearPlant(-1.0), fc.controllers.PDAlpha(k_p=0.1, k_d=1.0, alpha=0.9))
    with pytest.raises(ArgumentError, match="`period` must be a positive number, for the plant has none"):
        memory_multipliers(timeless)
    high = fc.ClosedLoop(HCWOutOfPlane(), _HighOrder())
    with pytest.raises(UnsupportedError, match="orders up to 1 of positions"):
        memory_multipliers(high)


class _HighOrder:
    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        return LinearLawTerms((FractionalTerm(-np.eye(n_controls), np.full(n_controls, 1.5)),))
