"""Volterra collocation against references in arbitrary precision: accuracy, panels, stiff gains, what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import PDAlpha
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWOutOfPlane
from fracctl.solvers import Contour, Volterra
from fracctl.trajectory import Trajectory
from tests.references import loops, poles
from tests.references.laplace import QuickReference, Reference
from tests.references.loops import Loop
from tests.references.product import check_times, closed_loop
from tests.solvers.test_closed_forms import Damper

HORIZONS = [4.0 * np.pi, 12.0 * np.pi]
PUBLISHED = loops.out_of_plane(0.85, 2.0, 0.91, [0.0, 0.002])
PAPER_GAINS = [[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]]
IN_PLANE = [m for m in loops.random_in_plane(41, 30, spread=2.0) if poles.unstable_count(m) == 0][:8]
OUT_OF_PLANE = list(loops.random_out_of_plane(40, 12))


def error(trajectory: Trajectory, i: int, member: Loop, digits: int = 16) -> float:
    """Return the largest error of positions and controls over their peaks."""
    times = np.concatenate([check_times(trajectory.horizon), np.linspace(0.05, trajectory.horizon, 80)])
    exact = Reference(member, digits)(times)
    position, control = np.atleast_3d(trajectory(times)), np.atleast_3d(trajectory.control(times))
    if not trajectory.batched:
        position, control = trajectory(times)[None], trajectory.control(times)[None]
    return float(
        max(
            np.abs(position[i, :, : member.size] - exact.position).max() / np.abs(exact.position).max(),
            np.abs(control[i] - exact.control).max() / np.abs(exact.control).max(),
        )
    )


def solved(members: list[Loop], solver: Volterra, horizon: float) -> Trajectory:
    return solver.solve(closed_loop(members), np.array([m.start for m in members]), horizon)


@pytest.mark.parametrize("panels", [None, 1])
def test_the_published_loop_to_nine_digits_with_32_nodes(panels: int | None) -> None:
    trajectory = solved([PUBLISHED], Volterra(32, panels), 4.0 * np.pi)
    assert error(trajectory, 0, PUBLISHED, digits=20) < 1e-9
    assert trajectory.counters["nodes"].item() <= 96


@pytest.mark.parametrize("horizon", HORIZONS)
@pytest.mark.parametrize(
    "member",
    [
        PUBLISHED,
        loops.out_of_plane(0.85, 2.0, 0.5, [1e-3, -1e-3]),
        loops.in_plane(PAPER_GAINS, [0.97, 0.9], [-1e-3, 0.0, 0.0, 2e-3]),
        loops.in_plane(PAPER_GAINS, [0.6, 0.55], [1e-3, -2e-3, 1e-3, 2e-3]),
    ],
    ids=["published", "half order", "in plane", "in plane, low orders"],
)
def test_nine_digits_on_panels(member: Loop, horizon: float) -> None:
    assert error(solved([member], Volterra(), horizon), 0, member) < 1e-9


@pytest.mark.parametrize("horizon", HORIZONS)
@pytest.mark.parametrize("members", [OUT_OF_PLANE, IN_PLANE], ids=["out of plane", "in plane"])
@pytest.mark.parametrize("nodes", [12, 20, 32, 48])
def test_the_estimate_bounds_the_error(members: list[Loop], nodes: int, horizon: float) -> None:
    trajectory = solved(members, Volterra(nodes), horizon)
    assert set(trajectory.status) == {"ok"}
    for i in range(0, len(members), 3):
        assert error(trajectory, i, members[i]) <= trajectory.error_estimate[i] <= 1e-8


@pytest.mark.parametrize("nodes", [4, 8, 14, 22, 32])
@pytest.mark.parametrize("panels", [1, 3])
def test_the_estimate_bounds_the_error_also_where_nodes_are_too_few(nodes: int, panels: int) -> None:
    """As long as it is below 10 %: given panels are never refined."""
    trajectory = solved(OUT_OF_PLANE, Volterra(nodes, panels), 4.0 * np.pi)
    for i, member in enumerate(OUT_OF_PLANE[:5]):
        if trajectory.error_estimate[i] < 0.1:
            assert error(trajectory, i, member) <= trajectory.error_estimate[i]
        assert (trajectory.status[i] == "ok") == (trajectory.error_estimate[i] <= 1e-8)
        assert trajectory.counters["nodes"][i] == nodes * panels


def test_a_single_loop_against_thirty_digits() -> None:
    times = np.array([1e-7, 1e-4, 0.03, 0.4, 2.2, 9.1, 30.0])
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91))
    trajectory = Volterra().solve(loop, np.array([1e-3, 2e-3]), 12.0 * np.pi)
    exact = Reference(PUBLISHED.replace(start=[1e-3, 2e-3]), 30).digits_at(times)
    np.testing.assert_allclose(trajectory(times)[:, :1], exact.position, atol=1e-9 * 1e-3)
    np.testing.assert_allclose(trajectory(times)[:, 1:], exact.rate, atol=1e-8 * 2e-3)
    np.testing.assert_allclose(trajectory.control(times), exact.control, atol=1e-9 * 5e-3)


def test_a_tighter_tolerance_takes_more_panels() -> None:
    nodes = {}
    for tolerance in (1e-4, 1e-8, 1e-10):
        trajectory = solved(OUT_OF_PLANE[:4], Volterra(12, tolerance=tolerance), 12.0 * np.pi)
        nodes[tolerance] = int(trajectory.counters["nodes"].sum())
        for i in range(4):
            assert error(trajectory, i, OUT_OF_PLANE[i]) < tolerance
    assert nodes[1e-4] < nodes[1e-8] < nodes[1e-10]


@pytest.mark.parametrize(
    ("k_p", "k_d", "alpha"),
    [(1e-6, 1e-6, 0.9), (0.0, 1e-3, 0.5), (100.0, 0.01, 0.7), (300.0, 30.0, 0.95), (0.5, 60.0, 0.6), (0.0, 2.0, 0.01)],
)
def test_extreme_gains(k_p: float, k_d: float, alpha: float) -> None:
    member = loops.out_of_plane(k_p, k_d, alpha, [1e-3, -2e-3])
    trajectory = solved([member], Volterra(), 4.0 * np.pi)
    assert trajectory.status.item() == "ok"
    assert error(trajectory, 0, member) <= trajectory.error_estimate.item() <= 1e-8


def test_what_needs_too_many_panels_is_refused_and_does_not_spoil_a_survey() -> None:
    stiff = ClosedLoop(HCWOutOfPlane(), PDAlpha(1e8, 0.01, 0.9))
    with pytest.raises(UnsupportedError, match="shorten the horizon, raise `nodes` or use 'contour'"):
        Volterra().solve(stiff, np.array([1e-3, 0.0]), 12.0)
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha([0.85, 1e8, 0.55], [2.0, 0.01, 2.0], 0.91))
    status = np.empty(3, dtype=object)
    for part in Volterra().survey(loop, np.array([[0.0, 0.002]]), 12.0):
        status[part.rows] = part.trajectory.status
    assert list(status) == ["ok", "failed", "ok"]


@pytest.mark.parametrize("alpha", [1.2, 1.5, 1.8])
def test_orders_above_one(alpha: float) -> None:
    """From w' alone, where Caputo's derivative kills w₀' t; no reference but an independent solver."""
    loop = ClosedLoop(HCWOutOfPlane(), Damper(0.8, alpha))
    times = np.linspace(0.0, 10.0, 60)
    exact, trajectory = (s.solve(loop, np.array([0.0, 1e-3]), 10.0) for s in (Contour(1e-10), Volterra()))
    assert np.abs(trajectory(times) - exact(times))[:, 0].max() < 1e-8 * np.abs(exact(times)[:, 0]).max()
    assert np.abs(trajectory.control(times) - exact.control(times)).max() < 1e-8 * np.abs(exact.controls).max()


def test_orders_too_near_two_are_refused_with_the_solver_to_use() -> None:
    loop = ClosedLoop(HCWOutOfPlane(), Damper(0.8, 1.93))
    with pytest.raises(UnsupportedError, match=r"takes orders up to 1\.85 .*, but one is 0\.08 above; use 'contour'"):
        Volterra().solve(loop, np.array([0.0, 1e-3]), 10.0)
    loop = ClosedLoop(HCWOutOfPlane(), Damper(0.8, 2.0))
    assert "solve the equation for its highest derivatives" in str(Volterra().supports(loop))


@pytest.mark.parametrize("horizon", [1e-6, 1e-2, 40.0 * np.pi])
def test_short_and_long_horizons(horizon: float) -> None:
    trajectory = solved(OUT_OF_PLANE[:2], Volterra(), horizon)
    times = horizon * np.sort(np.concatenate([np.geomspace(1e-6, 1.0, 8), np.linspace(0.05, 0.95, 11)]))
    for i, member in enumerate(OUT_OF_PLANE[:2]):
        exact = QuickReference(member)(times)
        assert np.abs(trajectory(times)[i, :, :1] - exact.position).max() < 1e-8 * np.abs(exact.position).max()
        assert np.abs(trajectory.control(times)[i] - exact.control).max() < 1e-8 * np.abs(exact.control).max()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"nodes": 3}, "`nodes` must be a whole number from 4 to 64"),
        ({"nodes": 65}, "`nodes` must be a whole number from 4 to 64"),
        ({"nodes": 8.5}, "`nodes` must be a whole number"),
        ({"panels": 0}, "`panels` must be a whole number from 1 to 128"),
        ({"panels": 129}, "`panels` must be a whole number from 1 to 128"),
        ({"tolerance": 0.0}, "`tolerance` must lie in"),
        ({"tolerance": np.nan}, "`tolerance` must lie in"),
        ({"cross_check": -0.1}, "`cross_check` must"),
    ],
)
def test_options_out_of_range_are_refused(options: dict[str, float], said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        Volterra(**options)  # type: ignore[arg-type]
