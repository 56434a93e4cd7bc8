"""PDD^α with the Coriolis matrix as K_D: u and v move on their own, as the out-of-plane loop does."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.config.build import build_evaluation
from fracctl.config.compose import compose
from fracctl.controllers import PDAlpha
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane
from fracctl.solvers import Collocation, Contour, Volterra
from fracctl.solvers.base import Solver
from tests.references import loops
from tests.references.laplace import Reference
from tests.references.product import check_times

EVALUATION = build_evaluation(compose(["experiment=inplane_decoupled"]))
HORIZON = 4.0 * np.pi
SOLVERS: list[Solver] = [Contour(), Volterra(), Collocation(128)]


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
@pytest.mark.parametrize("moved", [0, 1])
def test_only_what_is_displaced_moves(solver: Solver, moved: int) -> None:
    start = np.zeros(4)
    start[[moved, 2 + moved]] = -1e-3, 5e-4
    trajectory = solver.solve(EVALUATION.loop({}), start, HORIZON)
    times = check_times(HORIZON)
    positions = trajectory(times)[:, :2]
    exact = Reference(loops.out_of_plane(0.75, 1.95, 0.97, [-1e-3, 5e-4]))(times).position[:, 0]
    allowed = max(1e-8, trajectory.error_estimate.item() if solver.name == "collocation" else 0.0)
    assert np.abs(positions[:, moved] - exact).max() < allowed * 1e-3
    assert np.abs(positions[:, 1 - moved]).max() < 1e-16 * np.abs(exact).max()


def test_the_control_pays_for_it() -> None:
    """υ_v = 2u' holds v where it is."""
    start = np.array([-1e-3, 0.0, 0.0, 0.0])
    trajectory = Contour().solve(EVALUATION.loop({}), start, HORIZON)
    times = check_times(HORIZON)
    rate = Reference(loops.out_of_plane(0.75, 1.95, 0.97, [-1e-3, 0.0]))(times).rate[:, 0]
    np.testing.assert_allclose(trajectory.control(times)[:, 1], 2.0 * rate, atol=1e-8 * np.abs(2.0 * rate).max())


def test_the_settling_time_is_that_of_the_law_out_of_plane() -> None:
    """2.76466 is what the best law of the paper's grid for IC2 takes out of plane."""
    rows = EVALUATION({})
    assert rows["settling_time"][0] == pytest.approx(2.76466, abs=5e-6)


def test_without_the_integer_derivative_they_stay_coupled() -> None:
    law = PDAlpha(np.diag([4.75, 1.75]), [[1.95, 2.0], [-2.0, 1.95]], 0.97)
    trajectory = Contour().solve(ClosedLoop(HCWInPlane(), law), np.array([-1e-3, 0.0, 0.0, 0.0]), HORIZON)
    assert np.abs(trajectory(check_times(HORIZON))[:, 1]).max() > 1e-5
