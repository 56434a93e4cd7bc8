"""What the collocation solvers share with the contour solver: shapes, verdicts, surveys, configurations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fracctl.config.compose import compose
from fracctl.controllers import PDAlpha
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.execution.run import execute
from fracctl.loop import ClosedLoop
from fracctl.measures import ControlEffort, Overshoot, SettlingTime
from fracctl.plants import HCW, HCWInPlane, HCWOutOfPlane
from fracctl.solvers import Collocation, Contour, Volterra, solve
from fracctl.solvers.batched import BatchSolver
from fracctl.solvers.solve import make_solver
from tests.references import loops, poles, series
from tests.references.laplace import QuickReference
from tests.references.measures import ReferenceMeasures
from tests.references.product import check_times, closed_loop
from tests.solvers.test_closed_forms import Damper

SOLVERS = [Contour(), Volterra(), Collocation(64)]
EITHER = pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)


@EITHER
def test_shapes_with_and_without_a_batch(solver: BatchSolver) -> None:
    single, times = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91)), np.linspace(0.0, 5.0, 7)
    trajectory = solver.solve(single, np.array([0.0, 0.002]), 6.0)
    assert trajectory(times).shape == (7, 2)
    assert trajectory.control(times).shape == (7, 1)
    assert trajectory.states.shape == (len(trajectory.times), 2)
    trajectory = solver.solve(single, np.array([[0.0, 0.002], [0.001, 0.0], [0.0, 1.0]]), 6.0)
    assert trajectory(times).shape == (3, 7, 2)
    assert trajectory.status.shape == trajectory.stable.shape == trajectory.error_estimate.shape == (3,)
    batch = ClosedLoop(HCWOutOfPlane(), PDAlpha([0.85, 0.5], 2.0, [0.91, 0.8]))
    trajectory = solver.solve(batch, np.array([0.0, 0.002]), 6.0)
    assert trajectory.controls.shape == (2, len(trajectory.times), 1)
    assert all(values.shape == (2,) for values in trajectory.counters.values())
    assert np.all(trajectory.counters["nodes"] > 0)


@EITHER
def test_trajectories_begin_at_their_initial_values(solver: BatchSolver) -> None:
    """At s = 0 the Caputo derivative of order below 1 is 0, so υ = -K_P ξ₀; at order 1 it is ξ'."""
    start = np.array([1e-3, -2e-3, 5e-4, 2e-3])
    gains = np.array([[1.5, 0.3], [-0.2, 1.0]]), np.array([[2.0, 0.5], [0.1, 1.0]])
    for alpha, expected in (
        ([0.9, 0.8], -gains[0] @ start[:2]),
        ([1.0, 1.0], -gains[0] @ start[:2] - gains[1] @ start[2:]),
    ):
        trajectory = solver.solve(ClosedLoop(HCWInPlane(), PDAlpha(*gains, alpha)), start, 5.0)
        np.testing.assert_array_equal(trajectory([0.0])[0], start)
        np.testing.assert_allclose(trajectory.control([0.0])[0], expected, rtol=1e-8)
        np.testing.assert_allclose(trajectory([1e-9])[0], start, rtol=1e-5)


@EITHER
def test_no_motion_from_rest(solver: BatchSolver) -> None:
    loop = ClosedLoop(HCWInPlane(), PDAlpha(4.0 * np.eye(2), 2.0 * np.eye(2), 0.9))
    trajectory = solver.solve(loop, np.zeros(4), 5.0)
    assert not trajectory.states.any()
    assert not trajectory.controls.any()
    assert trajectory.status.item() == "ok"
    assert trajectory.error_estimate.item() < 1e-14


@EITHER
def test_verdicts_and_growing_solutions(solver: BatchSolver) -> None:
    """Negative damping grows and is told so; no damping is marginal; a fierce instability is given up."""
    k_p, k_d = np.array([0.5, 0.5, 0.5, -60.0]), np.array([1.0, 0.0, -0.3, 0.0])
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, 0.9))
    trajectory = solver.solve(loop, np.array([1e-3, 0.0]), 30.0)
    assert list(trajectory.stable) == [True, None, False, False]
    assert list(trajectory.status) == ["ok", "ok", "unstable", "diverged"]
    times = np.linspace(0.1, 30.0, 20)
    exact = QuickReference(loops.out_of_plane(0.5, -0.3, 0.9, [1e-3, 0.0]))(times).position
    assert np.abs(trajectory(times)[2, :, :1] - exact).max() < 1e-3 * np.abs(exact).max()
    assert np.isnan(trajectory(times)[3]).any()


@EITHER
def test_an_unstable_coordinate_beside_a_marginal_one(solver: BatchSolver) -> None:
    """In plane nothing acts, so poles lie at 0; out of plane w'' - w' + w = 0 grows all the same."""
    gain = np.diag([0.0, 0.0, -1.0])
    loop = ClosedLoop(HCW(), PDAlpha(np.zeros((3, 3)), np.stack([gain, -gain]), 1.0))
    start = np.array([1e-3, 0.0, 1e-3, 0.0, -2e-3, 0.0])
    trajectory = solver.solve(loop, start, 6.0)
    assert list(trajectory.stable) == [False, None]
    assert list(trajectory.status) == ["unstable", "ok"]
    angle = 0.75**0.5 * 6.0
    exact = 1e-3 * np.exp(3.0) * (np.cos(angle) - 0.5 / 0.75**0.5 * np.sin(angle))
    assert trajectory([6.0])[0, 0, 2] == pytest.approx(exact, rel=1e-6)
    parts = list(solver.survey(loop, start[None], 6.0))
    surveyed = {row: word for p in parts for row, word in zip(p.rows.tolist(), p.trajectory.status, strict=True)}
    assert surveyed == {0: "unstable", 1: "ok"}


@EITHER
def test_a_batch_of_diagonal_gains(solver: BatchSolver) -> None:
    """Some entries of the matrix differ from member to member, others are those of the plant for all."""
    k_p, k_d = (
        np.array([4.0, 5.0, 4.5])[:, None, None] * np.eye(2),
        np.array([2.0, 1.5, 2.5])[:, None, None] * np.eye(2),
    )
    start, times = np.array([1e-3, -2e-3, 5e-4, 2e-3]), np.linspace(0.0, 5.0, 11)
    together = solver.solve(ClosedLoop(HCWInPlane(), PDAlpha(k_p, k_d, [0.9, 0.8])), start, 5.0)(times)
    for i in range(3):
        alone = solver.solve(ClosedLoop(HCWInPlane(), PDAlpha(k_p[i], k_d[i], [0.9, 0.8])), start, 5.0)(times)
        np.testing.assert_allclose(together[i], alone, atol=2e-8 * np.abs(alone).max())


@EITHER
def test_the_whole_state_is_its_two_planes(solver: BatchSolver) -> None:
    """Uncoupled coordinates are solved apart and come out as they do alone."""
    k_p, k_d = np.diag([4.0, 0.4, 0.85]), np.diag([2.4, 1.95, 2.0])
    k_p[0, 1], k_p[1, 0] = -1.35, 3.15
    start = np.array([-1e-3, 0.0, 1e-3, 0.0, 2e-3, 2e-3])
    times = np.linspace(0.0, 9.0, 25)
    whole = solver.solve(ClosedLoop(HCW(), PDAlpha(k_p, k_d, [0.97, 0.9, 0.91])), start, 9.0)(times)
    plane = solver.solve(
        ClosedLoop(HCWInPlane(), PDAlpha(k_p[:2, :2], k_d[:2, :2], [0.97, 0.9])), start[[0, 1, 3, 4]], 9.0
    )
    out = solver.solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91)), start[[2, 5]], 9.0)
    np.testing.assert_allclose(whole[:, [0, 1, 3, 4]], plane(times), atol=2e-8 * np.abs(whole).max())
    np.testing.assert_allclose(whole[:, [2, 5]], out(times), atol=2e-8 * np.abs(whole).max())


@pytest.mark.parametrize("solver", [Volterra(), Collocation(128)], ids=lambda solver: solver.name)
@pytest.mark.parametrize("orders", ["shared", "own"])
def test_surveys(solver: BatchSolver, orders: str) -> None:
    """Every member once, from every start; the unstable without trajectory; measures as the reference has them."""
    horizon = 4.0 * np.pi
    members = list(loops.random_in_plane(90, 12, spread=2.5))
    if orders == "shared":
        members = [m.replace(alpha=[0.95, 0.7]) for m in members]
    loop = closed_loop(members)
    states = np.array([loops.initial_state(name, "uv") for name in ("ic1", "ic3")])
    seen = np.zeros(len(members), dtype=int)
    close = 1e-6 if solver.name == "volterra" else 2e-2
    stable = [poles.unstable_count(m) == 0 for m in members]
    assert 2 < sum(stable) < 10
    for part in solver.survey(loop, states, horizon):
        seen[part.rows] += 1
        measured = [m(part.trajectory)[m.name] for m in (SettlingTime(), Overshoot(), ControlEffort())]
        for place, row in enumerate(part.rows):
            for k, start in enumerate(states):
                i = k * len(part.rows) + place
                assert part.trajectory.stable[i] is stable[row]
                assert part.trajectory.status[i] == ("ok" if stable[row] else "unstable")
                assert np.isnan(part.trajectory.positions[i]).all() == (not stable[row])
                if stable[row]:
                    exact = ReferenceMeasures(QuickReference(members[row].replace(start=start)), horizon)
                    assert measured[0][i] == pytest.approx(exact.settling_time(), rel=close)
                    assert measured[1][i] == pytest.approx(exact.overshoot(), rel=close)
                    assert measured[2][i] == pytest.approx(exact.control_effort(), rel=close)
    assert np.all(seen == 1)


@EITHER
def test_integer_orders_of_unstable_loops(solver: BatchSolver) -> None:
    members = [m.replace(alpha=[1.0, 1.0]) for m in loops.random_in_plane(91, 8)]
    trajectory = solver.solve(closed_loop(members), np.array([m.start for m in members]), 3.0)
    times = check_times(3.0)
    for i, member in enumerate(members):
        growth = float(np.linalg.eigvals(poles.companion(member)).real.max())
        assert trajectory.stable[i] is (growth < 0)
        exact = series.matrix_exponential(member, times)[0][:, :2]
        allowed = max(1e-8, trajectory.error_estimate[i])
        assert np.abs(trajectory(times)[i, :, :2] - exact).max() < allowed * np.abs(exact).max()


@EITHER
def test_shapes_horizons_and_loops_that_are_refused(solver: BatchSolver) -> None:
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha([0.5, 0.6], 2.0, 0.9))
    with pytest.raises(ArgumentError, match="`initial_state` must have shape"):
        solver.solve(loop, np.zeros(3), 1.0)
    with pytest.raises(ArgumentError, match="`initial_state` must have the batch size of the loop, 2"):
        solver.solve(loop, np.zeros((3, 2)), 1.0)
    with pytest.raises(ArgumentError, match="`horizon` must be positive"):
        solver.solve(loop, np.zeros(2), -1.0)
    with pytest.raises(UnsupportedError, match="takes terms of an order below the highest"):
        solver.solve(ClosedLoop(HCWOutOfPlane(), Damper(2.0, 2.0)), np.zeros(2), 1.0)
    assert solver.supports(loop) is None


@pytest.mark.parametrize("name", ["contour", "volterra", "collocation", "explicit_memory"])
def test_solvers_by_name(name: str) -> None:
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91))
    trajectory = solve(loop, [0.0, 0.002], 12.0 * np.pi, solver=name)
    exact = float(series.fractional_oscillator(2.0, 1.85, 0.91, 0.0, 0.002, 3.0))
    assert trajectory.status.item() == "ok"
    assert float(trajectory([3.0])[0, 0]) == pytest.approx(exact, abs=1.5 * trajectory.error_estimate.item() * 7e-4)
    assert make_solver(name, 1e-4).tolerance == 1e-4


def test_an_unknown_solver_is_refused() -> None:
    with pytest.raises(ArgumentError, match=r"must be one of .* did you mean 'volterra'"):
        make_solver("voltera")
    with pytest.raises(ArgumentError, match="`solver` must be one of"):
        solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(1.0, 1.0, 0.9)), [0.0, 1.0], 1.0, solver=Contour())  # type: ignore[call-overload]


@pytest.mark.parametrize(
    "words",
    [
        ["solver=volterra"],
        ["solver=explicit_memory"],
        ["solver=collocation"],
        ["solver=collocation", "solver.form=first_order"],
    ],
)
def test_a_survey_by_configuration(words: list[str], tmp_path: Path) -> None:
    tiny = ["survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=[0.55,0.85]", "survey.axes.k_d_w=[0,2]"]
    config = compose(
        ["experiment=ic1_outofplane", *tiny, *words, "scheduler=serial", f"output_dir={tmp_path}", "figures=null"]
    )
    result = execute(config)
    assert result.summary["status"] == "finished"
    optimum = result.summary["optimum"]
    assert (optimum["alpha_w"], optimum["k_p_w"], optimum["k_d_w"]) == (0.91, 0.85, 2.0)
    assert optimum["settling_time"] == pytest.approx(3.01276, abs=5.1e-6 if "volterra" in words[0] else 2e-3)
    assert set(result.evaluations["status"]) == {"ok", "unsettled"}
