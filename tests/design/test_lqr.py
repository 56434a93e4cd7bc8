"""Gains of the linear-quadratic regulator against closed forms and the paper."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

import fracctl as fc
from fracctl.controllers import PD
from fracctl.design import LQR, gains_by_name, lqr
from fracctl.errors import ArgumentError
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant


def test_the_papers_seed() -> None:
    plant = HCWInPlane()
    exact = [[4.0119, -0.9474, 2.4244, 0.6732], [2.9960, 0.3200, 0.6732, 1.9697]]
    np.testing.assert_allclose(lqr(plant, np.eye(4), np.eye(2)), exact, atol=5e-5)
    printed = [[4.00, -0.95, 2.40, 0.65], [3.00, 0.30, 0.65, 1.95]]
    assert lqr(plant, round_to=0.05).tolist() == printed


def test_a_double_integrator() -> None:
    """x'' = υ with weights q₁, q₂ and r: k = [√(q₁/r), √(q₂/r + 2√(q₁/r))]."""
    first = math.sqrt(3.0 / 2.0)
    expected = [[first, math.sqrt(5.0 / 2.0 + 2.0 * first)]]
    np.testing.assert_allclose(lqr(LinearPlant(0.0), [3.0, 5.0], 2.0), expected, rtol=1e-12)


def cost(gains: np.ndarray, plant: LinearPlant, q: np.ndarray, r: np.ndarray, start: np.ndarray) -> float:
    """∫ (xᵀ Q x + υᵀ R υ) ds from the Lyapunov equation."""
    m = plant.n_controls
    closed = np.block([[np.zeros((m, m)), np.eye(m)], [plant.stiffness, plant.damping]])
    closed[m:] -= gains
    return float(start @ solve_continuous_lyapunov(closed.T, -(q + gains.T @ r @ gains)) @ start)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_other_gains_cost_less(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plant = HCWInPlane()
    root, r = rng.standard_normal((4, 4)), np.diag(rng.uniform(0.5, 2.0, 2))
    q, start = root @ root.T, rng.standard_normal(4)
    gains = lqr(plant, q, r)
    least = cost(gains, plant, q, r, start)
    for _ in range(20):
        assert cost(gains + 0.01 * rng.standard_normal((2, 4)), plant, q, r, start) > least


@pytest.mark.parametrize(
    ("weights", "said"),
    [
        ({"q": 0.0}, "`q` must weigh every motion that does not die out by itself"),
        ({"q": -1.0}, "`q` must be symmetric and positive semidefinite"),
        ({"r": 0.0}, "`r` must be symmetric and positive definite"),
        ({"q": [1.0, 2.0]}, r"`q` must be a number, a diagonal \(4,\) or a matrix \(4, 4\), but is of shape \(2,\)"),
        ({"round_to": 0.0}, "`round_to` must be a positive number, or null"),
    ],
)
def test_what_is_refused(weights: dict[str, object], said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        lqr(HCWInPlane(), **weights)  # type: ignore[arg-type]


def test_the_law_is_pd_with_these_gains() -> None:
    plant, times = HCWInPlane(), np.linspace(0.0, 10.0, 41)
    start = np.array([-0.001, 0.0, 0.0, 0.002])
    trajectory = fc.solve(fc.ClosedLoop(plant, LQR(q=[1.0, 2.0, 3.0, 4.0])), start, 10.0)
    gains = lqr(plant, [1.0, 2.0, 3.0, 4.0])
    closed = np.block([[np.zeros((2, 2)), np.eye(2)], [plant.stiffness - gains[:, :2], plant.damping - gains[:, 2:]]])
    expected = np.array([expm(closed * t) @ start for t in times])
    np.testing.assert_allclose(trajectory(times), expected, atol=1e-10)


def test_weights_are_parameters_also_of_a_batch() -> None:
    names = [parameter.name for parameter in LQR.parameters(("u", "v"))]
    assert names == ["q_u", "q_v", "q_u_dot", "q_v_dot", "r_u", "r_v"]
    law = LQR.from_parameters(("u", "v"), {"q_v": np.array([1.0, 9.0]), "r_u": 4.0}).for_plant(HCWInPlane())
    assert isinstance(law, PD)
    for member, q_v in enumerate((1.0, 9.0)):
        gains = lqr(HCWInPlane(), [1.0, q_v, 1.0, 1.0], [4.0, 1.0])
        np.testing.assert_allclose(law.k_p[member], gains[:, :2], rtol=1e-12)
        np.testing.assert_allclose(law.k_d[member], gains[:, 2:], rtol=1e-12)


def test_names_of_gains() -> None:
    gains = lqr(HCWOutOfPlane())
    assert gains_by_name(("w",), gains) == {"k_p_w": gains[0, 0], "k_d_w": gains[0, 1]}
    assert list(gains_by_name(("u", "v"), lqr(HCWInPlane())))[:3] == ["k_p_u", "k_p_uv", "k_p_vu"]
