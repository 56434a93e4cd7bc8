"""Laws with auxiliary states of many structures, against matrix exponentials of first-order forms written out here."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.linalg

from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.winding import unstable_zeros
from fracctl.controllers import LinearLawTerms
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane
from fracctl.solvers import Contour
from tests.systems.laws import IN_PLANE

HORIZON = 10.0
TIMES = np.concatenate([np.geomspace(1e-3, 0.1, 5), np.linspace(0.2, HORIZON, 40)])
START = np.array([1e-3, -2e-3, 5e-4, 2e-3])
K_P = np.array([[4.0, -0.95], [3.0, 0.3]])


@dataclass(frozen=True)
class Memory:
    """υ = -K_P ξ - C z,    z' = F ξ + E ξ' + A z,    z(0) not 0."""

    seen: np.ndarray
    """C, (2, q)."""
    fed: np.ndarray
    """F, (q, 2)."""
    fed_by_rates: np.ndarray
    """E, (q, 2)."""
    own: np.ndarray
    """A, (q, q)."""
    start: np.ndarray
    """z(0), (q,)."""

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        q = len(self.start)
        none, rates = np.zeros(2 + q), np.repeat([1.0, 0.0], [2, q])
        control = FractionalTerm(np.hstack([-K_P, -self.seen]), none)
        values = FractionalTerm(np.hstack([self.fed, self.own]), none)
        slopes = FractionalTerm(np.hstack([self.fed_by_rates, np.zeros((q, q))]), rates)
        return LinearLawTerms((control,), (values, slopes), self.start)

    @property
    def companion(self) -> np.ndarray:
        """The matrix of [ξ, ξ', z]."""
        q, (stiffness, damping) = len(self.start), IN_PLANE
        return np.block(
            [
                [np.zeros((2, 2)), np.eye(2), np.zeros((2, q))],
                [stiffness - K_P, damping, -self.seen],
                [self.fed, self.fed_by_rates, self.own],
            ]
        )


CASES = {
    "one lag of both": Memory(
        np.array([[2.4, 0.3], [0.7, 1.9]]),
        np.array([[0.3, 0.1], [0.0, 0.2]]),
        np.array([[5.0, 0.5], [0.0, 4.0]]),
        np.diag([-5.0, -4.0]),
        np.array([2e-3, -1e-3]),
    ),
    "three": Memory(
        np.array([[2.4, 0.0, 0.3], [0.65, 1.95, 0.0]]),
        np.array([[0.0, 0.0], [0.0, 0.0], [0.3, -0.4]]),
        np.array([[5.0, 0.0], [0.0, 3.0], [0.0, 0.0]]),
        np.diag([-5.0, -3.0, 0.0]),
        np.array([1e-3, 0.0, -1e-3]),
    ),
    "chain": Memory(
        np.array([[2.4, 0.65, 0.2], [0.65, 1.95, -0.1]]),
        np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]),
        np.array([[5.0, 0.0], [0.0, 3.0], [0.0, 0.0]]),
        np.array([[-5.0, 0.0, 0.0], [0.0, -3.0, 0.0], [1.0, -1.0, -2.0]]),
        np.array([1e-3, 0.0, -1e-3]),
    ),
    "one that grows by itself": Memory(
        np.array([[2.4, 0.65, 0.8], [0.65, 1.95, 0.0]]),
        np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]),
        np.array([[5.0, 0.0], [0.0, 3.0], [0.0, 0.0]]),
        np.diag([-5.0, -3.0, 0.02]),
        np.array([1e-3, 0.0, 2e-3]),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_positions_and_controls(name: str) -> None:
    law = CASES[name]
    states = np.array([scipy.linalg.expm(law.companion * t) @ [*START, *law.start] for t in TIMES])
    trajectory = Contour().solve(ClosedLoop(HCWInPlane(), law), START, HORIZON)
    positions, controls = states[:, :2], -states[:, :2] @ K_P.T - states[:, 4:] @ law.seen.T
    assert trajectory.error_estimate.item() <= 1e-8
    assert np.abs(trajectory(TIMES)[:, :2] - positions).max() < 1e-8 * np.abs(positions).max()
    assert np.abs(trajectory.control(TIMES) - controls).max() < 1e-8 * np.abs(controls).max()


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_poles_in_the_right_half_plane(name: str, sign: float) -> None:
    """Also where the lags see nothing or push the wrong way."""
    law = CASES[name]
    for gain in (sign, 0.2 * sign, 5.0 * sign):
        member = Memory(gain * law.seen, law.fed, law.fed_by_rates, law.own, law.start)
        poles = np.linalg.eigvals(member.companion)
        assert np.abs(poles.real).min() > 1e-6
        zeros, marginal = unstable_zeros(CharacteristicMatrix(ClosedLoop(HCWInPlane(), member).system))
        assert not marginal.any()
        assert zeros.item() == np.sum(poles.real > 0.0)


def test_states_that_are_eliminated() -> None:
    """Those that hold no other of their kind and do not grow by themselves."""
    found = {name: CharacteristicMatrix(ClosedLoop(HCWInPlane(), law).system) for name, law in CASES.items()}
    assert {name: matrix.split(list(range(matrix.size)))[1] for name, matrix in found.items()} == {
        "one lag of both": [2, 3],
        "three": [2, 3, 4],
        "chain": [2, 3],
        "one that grows by itself": [2, 3],
    }
