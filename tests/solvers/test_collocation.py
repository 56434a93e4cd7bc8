"""Fractional Chebyshev collocation: both forms, its estimate of the error, what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import DelayedFeedback, PDAlpha
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.plants import FunctionPlant, HCWInPlane, HCWOutOfPlane
from fracctl.solvers import Collocation, solve
from fracctl.solvers.blocks import solve_each
from tests.references import loops, poles, series
from tests.references.laplace import QuickReference, Reference
from tests.references.loops import Loop
from tests.references.product import check_times, closed_loop
from tests.solvers.test_closed_forms import Damper

PUBLISHED = loops.out_of_plane(0.85, 2.0, 0.91, [0.0, 0.002])
IN_PLANE = [m for m in loops.random_in_plane(31, 30, spread=2.0) if poles.unstable_count(m) == 0][:8]
OUT_OF_PLANE = list(loops.random_out_of_plane(30, 12))
FORMS = ["second_order", "first_order"]


def errors(members: list[Loop], solver: Collocation, horizon: float) -> tuple[np.ndarray, np.ndarray]:
    """Return true errors of positions and controls over their peaks, the larger of both, and their estimates."""
    times = np.concatenate([check_times(horizon), np.linspace(0.1, horizon, 60)])
    trajectory = solver.solve(closed_loop(members), np.array([m.start for m in members]), horizon)
    found = []
    for i, member in enumerate(members):
        exact = QuickReference(member)(times)
        position, control = trajectory(times)[i, :, : member.size], trajectory.control(times)[i]
        found.append(
            max(
                np.abs(position - exact.position).max() / np.abs(exact.position).max(),
                np.abs(control - exact.control).max() / np.abs(exact.control).max(),
            )
        )
    return np.array(found), trajectory.error_estimate


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("members", [OUT_OF_PLANE, IN_PLANE], ids=["out of plane", "in plane"])
@pytest.mark.parametrize(("nodes", "horizon"), [(48, 4.0 * np.pi), (96, 4.0 * np.pi), (128, 12.0 * np.pi)])
def test_the_estimate_bounds_the_error(members: list[Loop], nodes: int, horizon: float, form: str) -> None:
    """Wherever it is below 10 %; neither does it exaggerate beyond the convergence from N/2 to N."""
    true, estimates = errors(members, Collocation(nodes, form), horizon)
    resolved = estimates < 0.1
    assert resolved.sum() >= len(members) / 2
    assert np.all(true[resolved] <= estimates[resolved])
    assert np.median(estimates[resolved] / true[resolved]) < 200.0


@pytest.mark.parametrize("nodes", [4, 5, 9, 16])
def test_few_nodes_are_seen_to_be_too_few(nodes: int) -> None:
    true, estimates = errors(OUT_OF_PLANE, Collocation(nodes), 12.0 * np.pi)
    assert np.all(estimates > 0.02)
    assert np.median(true) > 0.02


@pytest.mark.parametrize("form", FORMS)
def test_control_and_rate_start_as_powers_of_time(form: str) -> None:
    """D^α w ~ w₀' s^(1-α)/Γ(2-α) between the first nodes too, where no polynomial follows it."""
    trajectory = Collocation(64, form).solve(closed_loop([PUBLISHED]), PUBLISHED.start, 4.0 * np.pi)
    times = np.geomspace(1e-8, 3e-3, 20)
    exact = Reference(PUBLISHED, 18)(times)
    np.testing.assert_allclose(trajectory.control(times)[0], exact.control, rtol=2e-3)
    np.testing.assert_allclose(trajectory(times)[0, :, 1:], exact.rate, rtol=1e-3)


@pytest.mark.parametrize("form", FORMS)
def test_orders_above_one(form: str) -> None:
    """D^1.4 acts on the rate in first-order form; from w' alone, where Caputo's derivative kills w₀' t."""
    loop = ClosedLoop(HCWOutOfPlane(), Damper(0.8, 1.4))
    start = np.array([0.0, 1e-3])
    times = np.linspace(0.0, 10.0, 60)
    exact = solve(loop, start, 10.0, solver="contour", tolerance=1e-10)
    trajectory = Collocation(128, form).solve(loop, start, 10.0)
    assert np.abs(trajectory(times) - exact(times))[:, 0].max() < 2e-3 * np.abs(exact(times)[:, 0]).max()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("horizon", [3.0, 4.0])
def test_the_estimate_knows_of_growing_solutions(form: str, horizon: float) -> None:
    """Rounding at the end, of the size of the peak, is an error of the initial values that grows with them."""
    members = [m.replace(alpha=[1.0, 1.0]) for m in loops.random_in_plane(91, 8)]
    times = np.linspace(0.1, horizon, 30)
    trajectory = Collocation(128, form).solve(closed_loop(members), np.array([m.start for m in members]), horizon)
    for i, member in enumerate(members):
        exact = series.matrix_exponential(member, times)[0][:, :2]
        error = np.abs(trajectory(times)[i, :, :2] - exact).max() / np.abs(exact).max()
        assert error <= trajectory.error_estimate[i] < 0.1


def test_the_two_forms_are_two_methods() -> None:
    times = np.linspace(0.1, 12.0, 50)
    second, first = (
        Collocation(32, form).solve(closed_loop([PUBLISHED]), PUBLISHED.start, 12.0)(times)[0] for form in FORMS
    )
    difference = np.abs(second - first)[:, 0].max() / np.abs(second[:, 0]).max()
    assert 1e-8 < difference < 1e-3


def test_a_status_for_those_above_the_tolerance() -> None:
    loop = closed_loop([PUBLISHED])
    good = Collocation(64, tolerance=1e-2).solve(loop, PUBLISHED.start, 4.0 * np.pi)
    poor = Collocation(64, tolerance=1e-4).solve(loop, PUBLISHED.start, 4.0 * np.pi)
    assert (good.status.item(), poor.status.item()) == ("ok", "failed")
    np.testing.assert_array_equal(good.positions, poor.positions)
    assert good.counters["nodes"].item() == 64 + 32


def test_members_do_not_depend_on_chunks_and_orders_of_others() -> None:
    members = [*OUT_OF_PLANE, *(m.replace(alpha=[0.8]) for m in OUT_OF_PLANE)]
    starts = np.array([m.start for m in members])
    together = Collocation(40).solve(closed_loop(members), starts, 6.0)
    for i in (0, 5, 12, 20):
        alone = Collocation(40).solve(closed_loop([members[i]]), starts[i], 6.0)
        np.testing.assert_allclose(
            together.positions[i], alone.positions[0], atol=1e-12 * np.abs(alone.positions).max()
        )


@pytest.mark.parametrize("nodes", [3, 0, -8, 2000, 12.5, "many"])
def test_numbers_of_nodes_are_refused(nodes: object) -> None:
    with pytest.raises(ArgumentError, match=r"`nodes` must be a whole number from 4 to 1024"):
        Collocation(nodes)  # type: ignore[arg-type]


def test_unknown_forms_and_tolerances_are_refused() -> None:
    with pytest.raises(ArgumentError, match=r"`form` must be one of \('second_order', 'first_order'\)"):
        Collocation(32, form="third_order")
    for tolerance in (0.0, -1.0, 1.0, np.nan):
        with pytest.raises(ArgumentError, match=r"`tolerance` must lie in \(0, 1\)"):
            Collocation(tolerance=tolerance)
    with pytest.raises(ArgumentError, match="`cross_check` must"):
        Collocation(cross_check=2.0)


def test_what_is_not_linear_is_refused_with_the_solver_to_use() -> None:
    loop = ClosedLoop(FunctionPlant(lambda t, x, u: u - x**3, 1, 1), DelayedFeedback([[1.0]], 1.0))
    sentence = "takes linear fractional loops, but this one has a nonlinear plant and delayed states; use 'method_of_st"
    with pytest.raises(UnsupportedError, match=sentence):
        Collocation().solve(loop, np.zeros(1), 1.0)


def test_hopeless_equations_come_out_as_failed() -> None:
    trajectory = Collocation(16).solve(
        ClosedLoop(HCWInPlane(), PDAlpha(1e30 * np.eye(2), 1e30 * np.eye(2), 0.9)), np.ones(4), 10.0
    )
    assert trajectory.status.item() == "failed"


def test_singular_systems_do_not_spoil_the_others() -> None:
    left = np.stack([np.eye(2), np.zeros((2, 2)), 2.0 * np.eye(2)])
    solution = solve_each(left, np.ones((3, 2, 1)))
    np.testing.assert_array_equal(solution[[0, 2], :, 0], [[1.0, 1.0], [0.5, 0.5]])
    assert np.isnan(solution[1]).all()
