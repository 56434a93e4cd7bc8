"""Loops with auxiliary states and integrals against matrix exponentials of their first-order form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fracctl import stability
from fracctl.controllers import PID, LinearLaw, PDDAlpha, PDLag, PILambdaDMu
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from fracctl.solvers import Collocation, Contour, Volterra
from fracctl.solvers.batched import BatchSolver
from tests.references.product import check_times
from tests.systems.laws import IN_PLANE, OUT_OF_PLANE, FirstOrder, filtered_pid, pid

K_P = np.array([[4.0, -0.95], [3.0, 0.3]])
K_I = np.array([[0.2, -0.1], [0.3, 0.1]])
K_D = np.array([[2.4, 0.65], [0.65, 1.95]])
NO = np.zeros((2, 2))
HORIZON = 20.0


@dataclass(frozen=True)
class Case:
    """A law in a plane, and its loop in first-order form."""

    name: str
    law: LinearLaw
    form: FirstOrder

    @property
    def loop(self) -> ClosedLoop:
        return ClosedLoop(HCWOutOfPlane() if self.size == 1 else HCWInPlane(), self.law)

    @property
    def size(self) -> int:
        return len(self.form.output)

    @property
    def start(self) -> np.ndarray:
        return np.array([1e-3, 2e-3] if self.size == 1 else [1e-3, -2e-3, 5e-4, 2e-3])


CASES = [
    Case("lag", PDLag(0.5, 2.0, 0.3), filtered_pid(*OUT_OF_PLANE, 0.5, 0.0, 2.0, 0.3)),
    Case("slow lag", PDLag(2.0, 0.5, 2.0), filtered_pid(*OUT_OF_PLANE, 2.0, 0.0, 0.5, 2.0)),
    Case("fast lag", PDLag(0.5, 2.0, 0.03), filtered_pid(*OUT_OF_PLANE, 0.5, 0.0, 2.0, 0.03)),
    Case("filtered PID", PID(0.5, 0.4, 2.0, 0.3), filtered_pid(*OUT_OF_PLANE, 0.5, 0.4, 2.0, 0.3)),
    Case("PID", PILambdaDMu(1.0, 0.7, 2.0), pid(*OUT_OF_PLANE, 1.0, 0.7, 2.0)),
    Case("PDD", PDDAlpha(1.0, 0.5, 1.5, 1.0), pid(*OUT_OF_PLANE, 1.0, 0.0, 2.0)),
    Case("lags", PDLag(K_P, K_D, [0.2, 0.1]), filtered_pid(*IN_PLANE, K_P, NO, K_D, [0.2, 0.1])),
    Case("filtered PID of two", PID(K_P, K_I, K_D, [0.2, 0.1]), filtered_pid(*IN_PLANE, K_P, K_I, K_D, [0.2, 0.1])),
    Case("PID of two", PILambdaDMu(K_P, K_I, K_D), pid(*IN_PLANE, K_P, K_I, K_D)),
    Case("PDD of two", PDDAlpha(K_P, 0.5 * K_D, 0.5 * K_D, 1.0), pid(*IN_PLANE, K_P, NO, K_D)),
]
SOLVERS: list[BatchSolver] = [Contour(), Volterra(), Collocation(128)]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
def test_trajectory_and_control(case: Case, solver: BatchSolver) -> None:
    trajectory = solver.solve(case.loop, case.start, HORIZON)
    times, m = check_times(HORIZON), case.size
    exact = case.form.states(case.start, times)
    controls, q = exact @ case.form.output.T, case.loop.system.n_auxiliary
    wanted = np.hstack([exact[:, : 2 * m], exact[:, exact.shape[1] - q :]])
    assert trajectory.status.item() == "ok"
    assert trajectory.stable.item() is True
    assert np.all(np.abs(trajectory(times) - wanted).max(axis=0) < 1e-8 * np.abs(wanted).max(axis=0))
    assert np.abs(trajectory.control(times) - controls).max() < 1e-8 * np.abs(controls).max()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_poles_are_eigenvalues(case: Case) -> None:
    check_poles(case)


def test_poles_of_an_unstable_loop() -> None:
    check_poles(Case("", PILambdaDMu(0.0, 2.0, 0.1), pid(*OUT_OF_PLANE, 0.0, 2.0, 0.1)))


def test_an_integral_of_one_combination_adds_one_pole() -> None:
    gain = np.outer([0.2, 0.3], [1.0, -0.5])
    check_poles(Case("", PILambdaDMu(K_P, gain, K_D), pid(*IN_PLANE, K_P, gain, K_D)))
    check_poles(Case("", PID(K_P, gain, K_D, 0.2), filtered_pid(*IN_PLANE, K_P, gain, K_D, 0.2)))


def check_poles(case: Case) -> None:
    """Without an integral gain, the first-order form has m poles at 0 more than the loop."""
    verdict = stability.assess(case.loop)
    expected = np.linalg.eigvals(case.form.matrix)
    expected = expected[np.abs(expected) > 1e-12]
    np.testing.assert_allclose(np.sort_complex(verdict.poles), np.sort_complex(expected), atol=1e-8)
    assert verdict.stable is bool(np.all(expected.real < 0))


@pytest.mark.parametrize("solver", [Contour(), Volterra()], ids=lambda solver: solver.name)
def test_members_of_a_batch_have_their_own_time_constants(solver: BatchSolver) -> None:
    k_p, k_i, k_d, lag = np.array([[0.5, 0.4, 2.0, 0.3], [1.0, 0.0, 1.0, 0.05], [2.0, 0.1, 0.5, 1.5]]).T
    trajectory = solver.solve(ClosedLoop(HCWOutOfPlane(), PID(k_p, k_i, k_d, lag)), [1e-3, 2e-3], HORIZON)
    times = check_times(HORIZON)
    for i in range(3):
        form = filtered_pid(*OUT_OF_PLANE, k_p[i], k_i[i], k_d[i], lag[i])
        exact = form.states(np.array([1e-3, 2e-3]), times)[:, 0]
        assert np.abs(trajectory(times)[i, :, 0] - exact).max() < 1e-8 * np.abs(exact).max()


@pytest.mark.parametrize("varied", range(3))
def test_members_of_a_batch_may_share_all_but_one_parameter(varied: int) -> None:
    values: list[object] = [0.5, 2.0, 0.3]
    values[varied] = np.array([1.0, 1.0, 0.9, 1.2]) * values[varied]
    times = check_times(HORIZON)
    trajectory = Contour().solve(ClosedLoop(HCWOutOfPlane(), PDLag(*values)), [1e-3, 2e-3], HORIZON)
    for i, (k_p, k_d, lag) in enumerate(np.broadcast(*values)):
        exact = filtered_pid(*OUT_OF_PLANE, k_p, 0.0, k_d, lag).states(np.array([1e-3, 2e-3]), times)[:, 0]
        assert np.abs(trajectory(times)[i, :, 0] - exact).max() < 1e-8 * np.abs(exact).max()


@pytest.mark.parametrize("lag", [1e-2, 1e-4])
@pytest.mark.parametrize("m", [1, 2])
def test_fast_lags_cost_a_few_nodes_more(m: int, lag: float) -> None:
    """Their poles lie near -1/T, far to the left, where contours need no height."""
    plant, matrices = (HCWOutOfPlane(), OUT_OF_PLANE) if m == 1 else (HCWInPlane(), IN_PLANE)
    k_p, k_d, start = (0.5, 2.0, [1e-3, 2e-3]) if m == 1 else (K_P, K_D, [1e-3, -2e-3, 5e-4, 2e-3])
    form, horizon = filtered_pid(*matrices, k_p, 0.0 * np.array(k_p), k_d, lag), 12.0 * np.pi
    trajectory = Contour().solve(ClosedLoop(plant, PDLag(k_p, k_d, lag)), start, horizon)
    times = np.concatenate([np.geomspace(0.01 * lag, 1.0, 30), np.linspace(1.1, horizon, 60)])
    states = form.states(np.array(start), times)
    controls = states @ form.output.T
    assert trajectory.status.item() == "ok"
    assert trajectory.counters["nodes"].item() < 1000
    assert np.abs(trajectory(times)[:, :m] - states[:, :m]).max() < 1e-8 * np.abs(states[:, :m]).max()
    assert np.abs(trajectory.control(times) - controls).max() < 1e-8 * np.abs(controls).max()
