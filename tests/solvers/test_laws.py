"""Laws with several orders under the three solvers, against references in arbitrary precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fracctl.controllers import LinearLaw, PDDAlpha, PILambdaDMu
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from fracctl.solvers import Collocation, Contour, ExplicitMemory, Solver, Volterra
from tests.references.laws import ActedLoop, Action
from tests.systems.laws import IN_PLANE, OUT_OF_PLANE

K_P = np.array([[4.0, -0.95], [3.0, 0.3]])
K_I = np.array([[0.2, -0.1], [0.3, 0.1]])
K_D = np.array([[2.4, 0.65], [0.65, 1.95]])
TIMES = np.array([0.003, 0.4, 2.0, 7.0, 12.0])
HORIZON = 12.5
Orders = tuple[float, ...]


@dataclass(frozen=True)
class Case:
    name: str
    law: LinearLaw
    actions: list[Action]
    start: tuple[float, ...]

    @property
    def loop(self) -> ClosedLoop:
        return ClosedLoop(HCWOutOfPlane() if len(self.start) == 2 else HCWInPlane(), self.law)

    def exact(self) -> np.ndarray:
        """Return positions and controls at `TIMES`, (t, 2m)."""
        plant = OUT_OF_PLANE if len(self.start) == 2 else IN_PLANE
        return np.array([ActedLoop(*plant, self.actions, self.start).at(time) for time in TIMES])


def pdd_alpha(name: str, k_p: object, k_d: object, k_d_alpha: object, alpha: Orders, start: Orders) -> Case:
    zero, one = (0.0,) * len(alpha), (1.0,) * len(alpha)
    actions = [Action(k_p, zero), Action(k_d, one), Action(k_d_alpha, alpha)]
    return Case(name, PDDAlpha(k_p, k_d, k_d_alpha, alpha), actions, start)


def pi_lambda_d_mu(
    name: str, k_p: object, k_i: object, k_d: object, lambda_: Orders, mu: Orders, start: Orders
) -> Case:
    actions = [Action(k_p, (0.0,) * len(mu)), Action(k_i, tuple(-order for order in lambda_)), Action(k_d, mu)]
    return Case(name, PILambdaDMu(k_p, k_i, k_d, lambda_, mu), actions, start)


CASES = [
    pdd_alpha("PDD^0.5", 0.8, 1.0, 0.7, (0.5,), (1e-3, 2e-3)),
    pdd_alpha("PDD^0.91, at rest", 0.85, -0.3, 2.0, (0.91,), (1e-3, 0.0)),
    pdd_alpha("PDD^α in plane", K_P, 0.6 * K_D, 0.4 * K_D, (0.6, 0.85), (1e-3, -2e-3, 5e-4, 2e-3)),
    pi_lambda_d_mu("PI^0.5D^0.8", 0.8, 0.5, 2.0, (0.5,), (0.8,), (1e-3, 2e-3)),
    pi_lambda_d_mu("PID^0.91", 0.8, 0.2, 2.0, (1.0,), (0.91,), (1e-3, 0.0)),
    pi_lambda_d_mu("PI^0.3D", 0.8, 0.3, 1.0, (0.3,), (1.0,), (0.0, 2e-3)),
    pi_lambda_d_mu("PI^λD^μ in plane", K_P, K_I, K_D, (0.7, 0.4), (0.95, 0.9), (1e-3, -2e-3, 5e-4, 2e-3)),
]
SOLVERS: list[Solver] = [Contour(), Volterra(), ExplicitMemory(), Collocation(128)]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_positions_and_controls(case: Case) -> None:
    exact, m = case.exact(), len(case.start) // 2
    for solver in SOLVERS:
        trajectory = solver.solve(case.loop, case.start, HORIZON)
        values = np.hstack([trajectory(TIMES)[:, :m], trajectory.control(TIMES)])
        allowed = trajectory.error_estimate.item() if solver.name == "collocation" else 1e-8
        assert trajectory.status.item() == "ok"
        assert trajectory.stable.item() is True
        assert allowed < 1e-2
        for part in (slice(None, m), slice(m, None)):
            peak = np.abs(exact[:, part]).max()
            assert np.abs(values[:, part] - exact[:, part]).max() < allowed * peak, solver.name


def test_members_of_a_batch_have_their_own_orders() -> None:
    cases = [case for case in CASES if isinstance(case.law, PILambdaDMu) and len(case.start) == 2]
    laws = [case.law for case in cases]
    names = ("k_p", "k_i", "k_d", "integral_order", "derivative_order")
    law = PILambdaDMu(*(np.ravel([getattr(one, name) for one in laws]) for name in names))
    starts = np.array([case.start for case in cases])
    for solver in (Contour(), Volterra(), ExplicitMemory()):
        trajectory = solver.solve(ClosedLoop(HCWOutOfPlane(), law), starts, HORIZON)
        for i, case in enumerate(cases):
            exact = case.exact()[:, 0]
            assert np.abs(trajectory(TIMES)[i, :, 0] - exact).max() < 1e-8 * np.abs(exact).max()
