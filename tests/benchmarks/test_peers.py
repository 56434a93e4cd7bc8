"""The peers solve the loops they are said to solve: against the references, each to the error it can reach."""

from __future__ import annotations

import numpy as np
import pytest

from tests.references import loops
from tests.references.laplace import Reference
from tests.references.loops import Loop

HORIZON = 4.0 * np.pi
LOOPS = {
    "out-of-plane": loops.out_of_plane(0.85, 2.0, 0.9, loops.initial_state("ic2", "w")),
    "in-plane": loops.in_plane(
        [[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]], [0.9, 0.8], loops.initial_state("ic2", "uv")
    ),
}
"""From IC2: displaced and moving, so that no term of the equations is absent."""


@pytest.fixture(params=LOOPS)
def loop(request: pytest.FixtureRequest) -> Loop:
    return LOOPS[request.param]


def error(loop: Loop, times: np.ndarray, positions: np.ndarray, controls: np.ndarray) -> float:
    exact = Reference(loop)(times)
    pairs = ((positions, exact.position), (controls, exact.control))
    return max(float(np.abs(got - wanted).max() / np.abs(wanted).max()) for got, wanted in pairs)


@pytest.mark.parametrize("own_root_finder", [False, True])
def test_product_integration_converges_to_the_solution(loop: Loop, own_root_finder: bool) -> None:
    pytest.importorskip("pycaputo", reason="extra `bench` is not installed")
    from benchmarks.peers.product_integration import ProductIntegration

    errors = []
    for steps in (50, 100):
        (solution,) = ProductIntegration(steps, own_root_finder=own_root_finder)([loop], HORIZON)
        errors.append(error(loop, solution.times, solution.positions, solution.controls))
    assert errors[1] < 5e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3), "the rule is of second order"


def test_stacked_loops_come_out_as_single_ones(loop: Loop) -> None:
    pytest.importorskip("pycaputo", reason="extra `bench` is not installed")
    from benchmarks.peers.product_integration import ProductIntegration

    other = loop.replace(k_p=1.1 * loop.k_p, start=2.0 * loop.start)
    stacked = ProductIntegration(40, loops=2)([loop, other], HORIZON)
    for member, solution in zip((loop, other), stacked, strict=True):
        (single,) = ProductIntegration(40)([member], HORIZON)
        np.testing.assert_allclose(solution.positions, single.positions, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(solution.controls, single.controls, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("algorithm", "options", "bound"),
    [("DeHoog", {}, 1e-8), ("DeHoog", {"M": 20, "T_FACTOR": 2}, 1e-7), ("Talbot", {"N": 64}, 1e-6)],
)
def test_inverse_laplace_transforms(loop: Loop, algorithm: str, options: dict[str, int], bound: float) -> None:
    pytest.importorskip("nilt", reason="extra `bench` is not installed")
    from benchmarks.peers.laplace import InverseLaplace

    (solution,) = InverseLaplace(algorithm, options)([loop], HORIZON)
    assert error(loop, solution.times, solution.positions, solution.controls) < bound


def test_the_closed_solution_is_exact(loop: Loop) -> None:
    pytest.importorskip("pymittagleffler", reason="extra `bench` is not installed")
    from benchmarks.peers.mittag_leffler import MittagLeffler

    (solution,) = MittagLeffler()([loop], HORIZON)
    assert error(loop, solution.times, solution.positions, solution.controls) < 1e-12


def test_common_denominators() -> None:
    pytest.importorskip("pymittagleffler", reason="extra `bench` is not installed")
    from benchmarks.peers.mittag_leffler import common_denominator

    assert common_denominator(np.array([0.99, 0.90])) == (100, [99, 90])
    assert common_denominator(np.array([0.5])) == (2, [1])
