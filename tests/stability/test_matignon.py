"""Verdicts by the pseudo-state matrix against the argument principle, eigenvalues, and cases decided by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fracctl import stability
from fracctl.controllers import LinearLaw, PDAlpha, PDDAlpha, PDLag, PILambdaDMu
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop
from fracctl.plants import HCW, HCWInPlane, HCWOutOfPlane, LinearPlant
from tests.references import loops, poles
from tests.stability.test_assess import same_set

GAINS = st.floats(-8.0, 8.0).map(lambda gain: round(gain, 2))
ORDERS = st.integers(1, 40).flatmap(lambda q: st.integers(-(-q // 5), q).map(lambda n: n / q))
"""From 0.2 up: the slowest poles go as the power 1/α of the gains."""
SQUARE = st.lists(GAINS, min_size=4, max_size=4).map(lambda gains: np.reshape(gains, (2, 2)))
PAIRS = st.sampled_from([2, 3, 5, 8, 10, 20]).flatmap(
    lambda q: st.tuples(st.integers(-(-q // 5), q), st.integers(-(-q // 5), q)).map(lambda n: (n[0] / q, n[1] / q))
)


def both_agree(plant: LinearPlant, law: LinearLaw) -> None:
    """Verdicts and poles, unless a pole is so near the axis that one of the two leaves it open."""
    loop = ClosedLoop(plant, law)
    first, second = stability.matignon(loop), stability.assess(loop)
    if first.stable is None or second.stable is None:
        return
    assert first.stable is second.stable
    assert "not all" not in second.certificate
    # a double zero of the determinant is known to the square root of the precision
    assert same_set(first.poles, second.poles, 1e-5), f"{first.poles} {second.poles}"


@settings(max_examples=60, deadline=None)
@given(GAINS, GAINS, ORDERS)
def test_out_of_plane(k_p: float, k_d: float, alpha: float) -> None:
    both_agree(HCWOutOfPlane(), PDAlpha(k_p, k_d, alpha))


@settings(max_examples=40, deadline=None)
@given(SQUARE, SQUARE, PAIRS)
def test_in_plane(k_p: np.ndarray, k_d: np.ndarray, alpha: tuple[float, float]) -> None:
    both_agree(HCWInPlane(), PDAlpha(k_p, k_d, alpha))


@settings(max_examples=30, deadline=None)
@given(SQUARE, SQUARE, SQUARE, PAIRS)
def test_laws_with_several_orders(first: np.ndarray, second: np.ndarray, third: np.ndarray, pair: tuple) -> None:
    both_agree(HCWInPlane(), PDDAlpha(first, second, third, pair))
    both_agree(HCWInPlane(), PILambdaDMu(first, 0.1 * second, third, pair, pair[::-1]))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_in_plane_at_orders_of_a_hundredth(seed: int) -> None:
    generator = np.random.default_rng(seed)
    member = next(loops.random_in_plane(700 + seed, 1, spread=3.0))
    both_agree(HCWInPlane(), PDAlpha(member.k_p, member.k_d, generator.integers(80, 100, 2) / 100.0))


def test_an_optimum_of_the_paper() -> None:
    """IC1's best law in plane, at orders of a hundredth: 400 eigenvalues; the poles in many digits."""
    member = loops.in_plane([[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]], [0.99, 0.9], np.zeros(4))
    verdict = stability.matignon(ClosedLoop(HCWInPlane(), PDAlpha(member.k_p, member.k_d, member.alpha)))
    assert verdict.stable is True
    assert verdict.denominator == 100
    assert len(verdict.eigenvalues) == 400
    assert same_set(verdict.poles, poles.poles(member), 1e-9)


def test_every_eigenvalue_solves_the_characteristic_equation() -> None:
    """w⁸ + k_D w³ + 1 + k_P = 0 at q = 4, α = 3/4: all sheets of the Riemann surface."""
    verdict = stability.matignon(ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.75)))
    expected = np.roots([1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.85])
    assert same_set(verdict.eigenvalues, expected, 1e-12)


def test_eigenvalues_of_uncoupled_coordinates_are_of_one_denominator() -> None:
    """w⁴ + 2 w + 1.5 = 0 and (w²)² + 3 w² + 1.7 = 0 for σ = w²: half and whole orders in one system."""
    law = PDAlpha(np.diag([0.5, 0.7]), np.diag([2.0, 3.0]), [0.5, 1.0])
    verdict = stability.matignon(ClosedLoop(LinearPlant(-np.eye(2)), law))
    assert verdict.denominator == 2
    expected = np.concatenate([np.roots([1.0, 0.0, 0.0, 2.0, 1.5]), np.roots([1.0, 0.0, 3.0, 0.0, 1.7])])
    assert same_set(verdict.eigenvalues, expected, 1e-12)


@pytest.mark.parametrize("k_d", [0.5, -0.5])
def test_the_sector_decides(k_d: float) -> None:
    """Two unstable poles for k_D < 0 lie in |arg w| < π/(2q), and none does for k_D > 0."""
    verdict = stability.matignon(ClosedLoop(HCWOutOfPlane(), PDAlpha(0.5, k_d, 0.5)))
    inside = np.abs(np.angle(verdict.eigenvalues)) < np.pi / (2 * verdict.denominator)
    assert verdict.stable is (k_d > 0.0)
    assert np.sum(inside) == (0 if k_d > 0.0 else 2)


def test_a_lag_has_integer_orders() -> None:
    loop = ClosedLoop(HCWInPlane(), PDLag(np.diag([4.0, 1.0]), 2.0 * np.eye(2), [0.2, 0.1]))
    verdict = stability.matignon(loop)
    assert verdict.denominator == 1
    assert same_set(verdict.poles, stability.assess(loop).poles, 1e-10)


@pytest.mark.parametrize("alpha", [1.0, 0.9, 0.5])
@pytest.mark.parametrize("plant", [HCW(), HCWInPlane(), HCWOutOfPlane()])
def test_free_motion_is_marginal(plant: LinearPlant, alpha: float) -> None:
    m = plant.n_controls
    assert stability.matignon(ClosedLoop(plant, PDAlpha(np.zeros((m, m)), np.zeros((m, m)), alpha))).stable is None


@pytest.mark.parametrize(
    ("k_p", "k_d", "expected"),
    [(-1.0, 1.0, None), (-1.0, 0.0, None), (0.5, 0.0, None), (-1.5, 2.0, False), (-1.0 - 1e-6, 2.0, False)],
)
def test_verdicts_that_follow_by_hand(k_p: float, k_d: float, expected: bool | None) -> None:
    assert stability.matignon(ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, 0.8))).stable is expected


def test_orders_without_a_common_denominator_are_refused() -> None:
    with pytest.raises(ArgumentError, match=r"`loop` must have orders that are fractions of one denominator up to 100"):
        stability.matignon(ClosedLoop(HCWOutOfPlane(), PDAlpha(1.0, 1.0, np.sqrt(0.5))))
    awkward = ClosedLoop(HCWInPlane(), PDAlpha(np.eye(2), np.eye(2), [1 / 3, 40 / 41]))
    with pytest.raises(ArgumentError, match=r"but is of orders 0, 1/3, 40/41, 1, 2; use `stability.assess`"):
        stability.matignon(awkward)
    assert stability.matignon(awkward, largest_denominator=123).denominator == 123


def test_a_batch_is_refused_with_a_sentence() -> None:
    with pytest.raises(ArgumentError, match="`loop` must be a single loop"):
        stability.matignon(ClosedLoop(HCWOutOfPlane(), PDAlpha([1.0, 2.0], 1.0)))
