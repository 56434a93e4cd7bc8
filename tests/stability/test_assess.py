"""Verdicts and principal-sheet poles against reference poles, eigenvalues and cases decided by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from fracctl import stability
from fracctl.controllers import LinearLawTerms, PDAlpha, PILambdaDMu
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop
from fracctl.plants import HCW, HCWInPlane, HCWOutOfPlane, LinearPlant
from fracctl.stability.assess import Verdict
from tests.references import loops, poles
from tests.references.loops import Loop


def single(member: Loop) -> ClosedLoop:
    if member.size == 1:
        return ClosedLoop(HCWOutOfPlane(), PDAlpha(member.k_p[0, 0], member.k_d[0, 0], member.alpha[0]))
    return ClosedLoop(HCWInPlane(), PDAlpha(member.k_p, member.k_d, member.alpha))


def same_set(first: np.ndarray, second: np.ndarray, tolerance: float) -> bool:
    """Whether two sets of poles pair up."""
    if len(first) != len(second):
        return False
    left = list(second)
    for p in first:
        distances = [abs(p - q) for q in left]
        if min(distances) > tolerance * max(1.0, abs(p)):
            return False
        left.pop(int(np.argmin(distances)))
    return True


@pytest.mark.parametrize("seed", range(12))
def test_poles_and_verdict_of_random_loops(seed: int) -> None:
    kinds = [
        lambda: next(loops.random_out_of_plane(40 + seed, 1)),
        lambda: next(loops.random_in_plane(40 + seed, 1)),
        lambda: next(loops.random_in_plane(40 + seed, 1, spread=2.0)),
    ]
    for kind in kinds:
        member = kind()
        verdict = stability.assess(single(member))
        expected = poles.poles(member)
        assert same_set(verdict.poles, expected, 1e-7), f"{verdict.poles} {expected}"
        assert verdict.stable is bool(np.all(expected.real < 0))
        assert verdict.certificate
        assert verdict.method
        assert np.all(np.diff(verdict.poles.real) <= 1e-9)


def test_poles_at_integer_orders_are_eigenvalues() -> None:
    for member in loops.random_in_plane(60, 10):
        verdict = stability.assess(single(member.replace(alpha=[1.0, 1.0])))
        expected = np.linalg.eigvals(poles.companion(member))
        assert same_set(verdict.poles, expected, 1e-9)
        assert verdict.stable is bool(np.all(expected.real < 0))


@pytest.mark.parametrize("criterion", [stability.assess, stability.matignon])
def test_integer_orders_beside_others_have_their_real_poles(criterion: Callable[[ClosedLoop], Verdict]) -> None:
    """w'' + 5 w' + 3 w = 0 has the poles (-5 ± √13)/2, whatever the orders in plane, which has its own."""
    k_p, k_d = np.diag([4.0, 2.0, 2.0]), np.diag([2.0, 2.0, 5.0])
    found = criterion(ClosedLoop(HCW(), PDAlpha(k_p, k_d, [0.9, 0.9, 1.0])))
    plane = criterion(ClosedLoop(HCWInPlane(), PDAlpha(k_p[:2, :2], k_d[:2, :2], [0.9, 0.9])))
    real = 0.5 * (-5.0 + np.array([1.0, -1.0]) * np.sqrt(13.0))
    assert len(plane.poles) == 4
    assert same_set(found.poles, np.append(plane.poles, real), 1e-9)
    assert np.all(np.diff(found.poles.real) <= 1e-9)
    assert found.stable is True


def test_number_of_poles_jumps_at_order_one() -> None:
    """w'' + 3 D^α w + w = 0 has two real poles at α = 1; below, they leave the principal sheet or pair up."""
    assert len(stability.assess(ClosedLoop(HCWOutOfPlane(), PDAlpha(0.0, 3.0, 1.0))).poles) == 2
    member = loops.out_of_plane(0.0, 3.0, 0.95, [1.0, 0.0])
    assert len(stability.assess(single(member)).poles) == poles.sheet_count(member)


@pytest.mark.parametrize("alpha", [1.0, 0.9, 0.4])
@pytest.mark.parametrize("plant", [HCW(), HCWInPlane(), HCWOutOfPlane()])
def test_free_motion_is_marginal(plant: LinearPlant, alpha: float) -> None:
    m = plant.n_controls
    nothing = np.zeros((m, m)) if m > 1 else 0.0
    assert stability.assess(ClosedLoop(plant, PDAlpha(nothing, nothing, alpha))).stable is None


def test_a_zero_at_the_origin_hides_no_instability_of_another_coordinate() -> None:
    """Free motion in plane is marginal; out of plane σ² - σ + 1 = 0 has the zeros 0.5 ± 0.87i."""
    gain = np.diag([0.0, 0.0, -1.0])
    verdict = stability.assess(ClosedLoop(HCW(), PDAlpha(np.zeros((3, 3)), gain, 1.0)))
    assert verdict.stable is False
    assert "2 zeros of uncoupled coordinates" in verdict.certificate
    assert same_set(verdict.poles[:2], np.array([0.5 + 0.75**0.5 * 1j, 0.5 - 0.75**0.5 * 1j]), 1e-9)
    batch = ClosedLoop(HCW(), PDAlpha(np.zeros((3, 3)), np.stack([gain, -gain, 0.0 * gain]), 1.0))
    assert stability.margins(batch).stable.tolist() == [False, None, None]


@pytest.mark.parametrize(
    ("k_p", "k_d", "expected"),
    [
        (0.5, 0.0, None),
        (-1.0, 0.0, None),
        (-1.0, 1.0, None),
        (-1.5, 0.0, False),
        (-1.5, 2.0, False),
        (0.5, 1e-9, True),
        (0.5, -1e-9, False),
        (0.5, 1e-6, True),
        (-1.0 + 1e-9, 1.0, True),
        (-1.0 - 1e-9, 1.0, False),
        (-1.0 + 1e-12, -1e-7, False),
        (-1.0 + 1e-12, 1e-7, True),
    ],
)
@pytest.mark.parametrize("alpha", [1.0, 0.8])
def test_verdicts_that_follow_by_hand(k_p: float, k_d: float, expected: bool | None, alpha: float) -> None:
    """σ² + k_D σ^α + 1 + k_P: marginal for k_D = 0 or a zero at σ = 0, else decided by the signs."""
    assert stability.assess(ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, alpha))).stable is expected


@pytest.mark.parametrize(("k_d", "split"), [(1e-2, 0.0), (-1e-2, 0.0), (1e-4, 1e-4), (-1e-7, 1e-4), (1e-7, 1e-2)])
def test_two_weakly_damped_pairs_close_together(k_d: float, split: float) -> None:
    """Both pairs cross, or neither: a path that steps over 2π of phase would count 0 or 2 instead of 4 or 0."""
    loop = ClosedLoop(
        LinearPlant(np.diag([-1.0, -1.0 - split])), PDAlpha(np.zeros((2, 2)), k_d * np.eye(2), [0.9, 0.9])
    )
    assert stability.assess(loop).stable is (k_d > 0)


def test_a_batch_is_refused_with_a_sentence() -> None:
    with pytest.raises(ArgumentError, match="`loop` must be a single loop"):
        stability.assess(ClosedLoop(HCWOutOfPlane(), PDAlpha([1.0, 2.0], 1.0)))


def test_double_poles_are_found_twice() -> None:
    """Two equal oscillators: every zero of the determinant is double."""
    one = stability.assess(ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91)))
    plant = LinearPlant(-np.eye(2))
    two = stability.assess(ClosedLoop(plant, PDAlpha(0.85 * np.eye(2), 2.0 * np.eye(2), 0.91)))
    assert same_set(two.poles, np.repeat(one.poles, 2), 1e-6)
    assert "not all" not in two.certificate


def test_a_slow_and_a_fast_pole() -> None:
    """σ² + k_D σ^α + c with small c < 0 has a zero at σ = (-c/k_D)^(1/α), to the order σ^(2-α) relative."""
    member = loops.out_of_plane(-1.0 - 1e-5, 2.0, 0.5, [1.0, 0.0])
    verdict = stability.assess(single(member))
    assert verdict.poles[0] == pytest.approx(25e-12, rel=1e-4)
    assert "not all" not in verdict.certificate
    member = loops.out_of_plane(0.0, 1e4, 0.5, [1.0, 0.0])
    assert same_set(stability.assess(single(member)).poles, poles.poles(member), 1e-7)


@pytest.mark.parametrize("k_i", [-1e-3, -1e-7])
def test_a_small_negative_integral_gain_is_unstable(k_i: float) -> None:
    """σ² + k_D σ^μ + 1 + k_P + k_I σ^(-λ) is negative near 0: a zero at σ = (-k_I/(1 + k_P))^(1/λ) or nearby."""
    verdict = stability.assess(ClosedLoop(HCWOutOfPlane(), PILambdaDMu(0.5, k_i, 1.0, 0.5, 0.9)))
    assert verdict.stable is False
    assert verdict.poles[0] == pytest.approx((-k_i / 1.5) ** 2, rel=1e-4)


@dataclass(frozen=True)
class Inertia:
    """υ = -k D^α w - 0.2 w'."""

    k: float
    alpha: float = 2.0

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        terms = ((self.k, self.alpha), (0.2, 1.0))
        return LinearLawTerms(tuple(FractionalTerm(np.array([[-k]]), np.array([order])) for k, order in terms))


CRITERIA = [stability.assess, stability.matignon, stability.margins, stability.noise_gain]


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("k", [-1.5, 0.5, 3.0])
def test_a_term_of_the_highest_order_is_refused(criterion: Callable[[ClosedLoop], object], k: float) -> None:
    """(1 + k) w'' + 0.2 w' + w = 0 has a pole at 1.63 for k = -1.5: M̃ does not tend to I, and no bound holds."""
    with pytest.raises(UnsupportedError, match=r"one is of that order; solve the equation for its highest derivatives"):
        criterion(ClosedLoop(HCWOutOfPlane(), Inertia(k)))


def test_an_order_next_to_the_highest() -> None:
    """Poles of σ² + k σ^α with |σ|^(2-α) = k: beyond e^100 for k = 3 and 2 - α = 0.01, beyond all numbers for 1e-4."""
    verdict = stability.assess(ClosedLoop(HCWOutOfPlane(), Inertia(-3.0, 1.99)))
    assert verdict.stable is False
    assert verdict.poles[0] == pytest.approx(3.0**100.0, rel=1e-6)
    with pytest.raises(UnsupportedError, match=r"an order is only 0\.0001 below the highest"):
        stability.assess(ClosedLoop(HCWOutOfPlane(), Inertia(3.0, 1.9999)))
