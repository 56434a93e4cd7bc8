"""The contour solver against references in arbitrary precision, matrix exponentials and the free motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.linalg import expm

from fracctl.controllers import PDAlpha
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant
from fracctl.solvers import Contour, solve
from tests.references import loops, poles, series
from tests.references.laplace import Reference
from tests.references.loops import Loop
from tests.references.product import check_times, closed_loop
from tests.references.product import solve as solve_batch

HORIZONS = [4.0 * np.pi, 12.0 * np.pi]


def stable(members: Sequence[Loop], count: int) -> list[Loop]:
    chosen = [member for member in members if poles.unstable_count(member) == 0]
    assert len(chosen) >= count
    return chosen[:count]


OUT_OF_PLANE = list(loops.random_out_of_plane(20, 40))
IN_PLANE = [
    *stable(list(loops.random_in_plane(21, 80, spread=2.0)), 15),
    *stable(list(loops.random_in_plane(22, 300)), 10),
]


@pytest.fixture(scope="module")
def references() -> dict[int, Reference]:
    """References by the identity of their loops, each worked out once."""
    return {id(member): Reference(member, 16) for member in [*OUT_OF_PLANE, *IN_PLANE]}


def worst_error(members: list[Loop], references: dict[int, Reference], horizon: float) -> float:
    """Return the largest error of positions and controls over all members, relative to each component's peak."""
    trajectory = solve_batch(members, horizon)
    assert set(trajectory.status) == {"ok"}
    assert all(verdict is True for verdict in trajectory.stable)
    times, dense = check_times(horizon), np.linspace(0.25, horizon, 1500)
    computed = trajectory(times), trajectory.control(times)
    errors = []
    for i, member in enumerate(members):
        exact, everywhere = references[id(member)](times), references[id(member)](dense)
        for values, name in zip(computed, ("position", "control"), strict=True):
            wanted = getattr(exact, name)
            peak = np.maximum(np.abs(wanted).max(axis=0), np.abs(getattr(everywhere, name)).max(axis=0))
            errors.append((np.abs(values[i, :, : member.size] - wanted).max(axis=0) / peak).max())
        assert trajectory.error_estimate[i] <= 1e-8
    return max(errors)


@pytest.mark.parametrize("horizon", HORIZONS)
def test_random_stable_loops_out_of_plane(references: dict[int, Reference], horizon: float) -> None:
    assert worst_error(OUT_OF_PLANE, references, horizon) < 1e-8


@pytest.mark.parametrize("horizon", HORIZONS)
def test_random_stable_loops_in_plane(references: dict[int, Reference], horizon: float) -> None:
    assert worst_error(IN_PLANE, references, horizon) < 1e-8


@pytest.mark.parametrize("member", [OUT_OF_PLANE[0], IN_PLANE[0], IN_PLANE[-1]])
def test_a_single_loop_against_thirty_digits(member: Loop) -> None:
    times = np.array([1e-5, 0.03, 0.4, 2.2, 9.1, 30.0])
    single = ClosedLoop(
        HCWOutOfPlane() if member.size == 1 else HCWInPlane(),
        PDAlpha(member.k_p if member.size == 2 else member.k_p[0, 0], np.squeeze(member.k_d), np.squeeze(member.alpha)),
    )
    trajectory = Contour(1e-8).solve(single, member.start, 12.0 * np.pi)
    exact = Reference(member, 30).digits_at(times)
    for computed, wanted in (
        (trajectory(times)[:, : member.size], exact.position),
        (trajectory.control(times), exact.control),
    ):
        assert computed.shape == wanted.shape
        assert np.abs(computed - wanted).max() < 1e-8 * np.abs(wanted).max()


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-10])
def test_tolerance_is_kept(references: dict[int, Reference], tolerance: float) -> None:
    horizon = 12.0 * np.pi
    for members in (OUT_OF_PLANE[:10], IN_PLANE[:8]):
        trajectory = solve_batch(members, horizon, tolerance)
        times = check_times(horizon)
        for i, member in enumerate(members):
            exact = references[id(member)](times)
            peak = np.abs(references[id(member)](np.linspace(0.25, horizon, 400)).position).max()
            assert np.abs(trajectory(times)[i, :, : member.size] - exact.position).max() < tolerance * peak


def test_rates_are_right(references: dict[int, Reference]) -> None:
    times = check_times(12.0 * np.pi)
    for members in (OUT_OF_PLANE, IN_PLANE):
        states = solve_batch(members, 12.0 * np.pi)(times)
        for i, member in enumerate(members):
            exact = references[id(member)](times).rate
            peak = np.abs(references[id(member)](np.linspace(0.25, 12.0 * np.pi, 400)).rate).max()
            assert np.abs(states[i, :, member.size :] - exact).max() < 1e-7 * peak


@pytest.mark.parametrize("size", [1, 2])
def test_integer_orders_equal_the_matrix_exponential(size: int) -> None:
    """α = 1, to 1e-10 of the peak where the tolerance is 1e-10."""
    members = [m.replace(alpha=np.ones(size)) for m in (OUT_OF_PLANE if size == 1 else IN_PLANE)]
    horizon = 12.0 * np.pi
    times = check_times(horizon)
    trajectory = solve_batch(members, horizon, tolerance=1e-10)
    states, controls = trajectory(times), trajectory.control(times)
    for i, member in enumerate(members):
        growth = float(np.linalg.eigvals(poles.companion(member)).real.max())
        assert trajectory.stable[i] is (growth < 0)
        assert trajectory.status[i] == ("ok" if growth < 0 else "unstable")
        exact, exact_control = series.matrix_exponential(member, times)
        dense, dense_control = series.matrix_exponential(member, np.linspace(0.0, horizon, 300))
        m = member.size
        assert np.abs(states[i, :, :m] - exact[:, :m]).max() < 1e-10 * np.abs(dense[:, :m]).max()
        assert np.abs(controls[i] - exact_control).max() < 1e-10 * np.abs(dense_control).max()


@pytest.mark.parametrize("alpha", [1.0, 0.9, 0.5])
def test_no_gain_is_free_motion(alpha: float) -> None:
    """K = 0 leaves the Clohessy-Wiltshire solution with its drift: exactly marginal, so `stable` is None."""
    horizon = 12.0 * np.pi
    times = check_times(horizon)
    start = np.array([1e-3, -2e-3, 5e-4, 1e-3])
    trajectory = Contour().solve(
        ClosedLoop(HCWInPlane(), PDAlpha(np.zeros((2, 2)), np.zeros((2, 2)), alpha)), start, horizon
    )
    exact = series.free_in_plane(start, times)
    assert trajectory.stable.item() is None
    assert np.abs(trajectory(times)[:, :2] - exact[:, :2]).max() < 1e-8 * np.abs(exact[:, :2]).max()
    assert not trajectory.control(times).any()
    trajectory = Contour().solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(0.0, 0.0, alpha)), start[:2], horizon)
    exact = series.free_out_of_plane(start[:2], times)
    assert trajectory.stable.item() is None
    assert np.abs(trajectory(times)[:, :1] - exact[:, :1]).max() < 1e-8 * np.abs(exact[:, :1]).max()


def test_undamped_and_barely_damped_loops() -> None:
    """k_D = 0 is marginal; a k_D of either sign decides, however small."""
    k_d = np.array([0.0, 1e-6, -1e-6, 1e-3, -1e-3])
    trajectory = Contour().solve(
        ClosedLoop(HCWOutOfPlane(), PDAlpha(0.5, k_d, 0.9)), np.array([1e-3, 0.0]), 12.0 * np.pi
    )
    assert list(trajectory.stable) == [None, True, False, True, False]
    times = check_times(12.0 * np.pi)
    exact = 1e-3 * np.cos(np.sqrt(1.5) * times)
    assert np.abs(trajectory(times)[0, :, 0] - exact).max() < 1e-11
    for i in (1, 3):
        reference = Reference(loops.out_of_plane(0.5, k_d[i], 0.9, [1e-3, 0.0]), 18)(times)
        assert np.abs(trajectory(times)[i, :, 0] - reference.position[:, 0]).max() < 1e-11


def test_trajectories_are_linear_in_the_initial_state() -> None:
    gains = [IN_PLANE[0], IN_PLANE[-1]]
    first, second = np.array([1e-3, 0.0, -2e-3, 1e-3]), np.array([0.0, 3e-3, 1e-3, 0.0])
    times = check_times(4.0 * np.pi)

    def at(start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        trajectory = solve_batch([g.replace(start=start) for g in gains], 4.0 * np.pi)
        return trajectory(times), trajectory.control(times)

    for sum_, one, two in zip(at(2.0 * first - 3.0 * second), at(first), at(second), strict=True):
        np.testing.assert_allclose(sum_, 2.0 * one - 3.0 * two, atol=1e-13 * np.abs(one).max())


def test_members_do_not_depend_on_their_company(references: dict[int, Reference]) -> None:
    """Alone, in a batch of equal orders, or among different orders: the same trajectory to the tolerance."""
    times = check_times(12.0 * np.pi)
    alone = solve_batch(IN_PLANE[:1], 12.0 * np.pi)
    together = solve_batch(IN_PLANE, 12.0 * np.pi)
    shared = solve_batch([m.replace(alpha=IN_PLANE[0].alpha) for m in IN_PLANE], 12.0 * np.pi)
    peak = np.abs(alone.states[..., :2]).max()
    for other in (together, shared):
        assert np.abs(other(times)[0, :, :2] - alone(times)[0, :, :2]).max() < 2e-8 * peak


def test_orders_a_member_equal_orders_shared() -> None:
    loop = IN_PLANE[0]
    law = PDAlpha(loop.k_p, loop.k_d, loop.alpha)
    batched = PDAlpha(loop.k_p, loop.k_d, np.array([loop.alpha, loop.alpha * 0.99]))
    times = check_times(4.0 * np.pi)
    one = Contour().solve(ClosedLoop(HCWInPlane(), law), loop.start, 4.0 * np.pi)
    two = Contour().solve(ClosedLoop(HCWInPlane(), batched), loop.start, 4.0 * np.pi)
    np.testing.assert_allclose(two(times)[0], one(times), atol=1e-8 * np.abs(one.states).max())


def test_shapes_with_and_without_a_batch() -> None:
    single, times = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91)), np.linspace(0.0, 5.0, 7)
    trajectory = Contour().solve(single, np.array([0.0, 0.002]), 6.0)
    assert trajectory(times).shape == (7, 2)
    assert trajectory.control(times).shape == (7, 1)
    assert trajectory.states.shape == (len(trajectory.times), 2)
    trajectory = Contour().solve(single, np.array([[0.0, 0.002], [0.001, 0.0], [0.0, 1.0]]), 6.0)
    assert trajectory(times).shape == (3, 7, 2)
    assert trajectory.status.shape == trajectory.stable.shape == trajectory.error_estimate.shape == (3,)
    batch = ClosedLoop(HCWOutOfPlane(), PDAlpha([0.85, 0.5], 2.0, 0.91))
    trajectory = Contour().solve(batch, np.array([0.0, 0.002]), 6.0)
    assert trajectory.controls.shape == (2, len(trajectory.times), 1)
    assert all(values.shape == (2,) for values in trajectory.counters.values())


def test_trajectories_begin_at_their_initial_values() -> None:
    """At s = 0 the Caputo derivative of order below 1 is 0, so υ = -K_P ξ₀; at order 1 it is ξ'."""
    start = np.array([1e-3, -2e-3, 5e-4, 2e-3])
    gains = np.array([[1.5, 0.3], [-0.2, 1.0]]), np.array([[2.0, 0.5], [0.1, 1.0]])
    for alpha, expected in (
        ([0.9, 0.8], -gains[0] @ start[:2]),
        ([1.0, 1.0], -gains[0] @ start[:2] - gains[1] @ start[2:]),
    ):
        trajectory = Contour().solve(ClosedLoop(HCWInPlane(), PDAlpha(*gains, alpha)), start, 5.0)
        np.testing.assert_array_equal(trajectory([0.0])[0], start)
        np.testing.assert_allclose(trajectory.control([0.0])[0], expected, rtol=1e-8)
        np.testing.assert_allclose(trajectory([1e-9])[0], start, rtol=1e-5)


def test_no_motion_from_rest() -> None:
    loop = ClosedLoop(HCWInPlane(), PDAlpha(4.0 * np.eye(2), 2.0 * np.eye(2), 0.9))
    trajectory = Contour().solve(loop, np.zeros(4), 5.0)
    assert not trajectory.states.any()
    assert not trajectory.controls.any()
    assert trajectory.status.item() == "ok"


def test_a_users_own_plant() -> None:
    """Three coupled oscillators with the same orders in every column, diagonal in a rotated frame."""
    angle = 0.7
    rotation = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    stiffness = rotation @ np.diag([-1.0, -2.0, -3.0]) @ rotation.T
    loop = ClosedLoop(LinearPlant(stiffness), PDAlpha(0.5 * np.eye(3), 0.8 * np.eye(3), 0.85))
    start = np.array([1.0, 0.5, -1.0])
    trajectory = Contour().solve(loop, np.concatenate([start, np.zeros(3)]), 10.0)
    times = check_times(10.0)
    modes = rotation.T @ start
    exact = np.stack(
        [
            modes[k] * Reference(loops.out_of_plane(k + 0.5, 0.8, 0.85, [1.0, 0.0]), 18)(times).position[:, 0]
            for k in range(3)
        ],
        axis=1,
    )
    assert np.abs(trajectory(times)[:, :3] - exact @ rotation.T).max() < 2e-8


def test_published_loop_through_the_library_call() -> None:
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p=0.85, k_d=2.0, alpha=0.91))
    trajectory = solve(loop, initial_state=[0.0, 0.002], horizon=12 * np.pi, solver="contour", tolerance=1e-8)
    exact = series.fractional_oscillator(2.0, 1.85, 0.91, 0.0, 0.002, 3.0)
    assert float(trajectory([3.0])[0, 0]) == pytest.approx(float(exact), abs=1e-8 * 0.0007)


@pytest.mark.parametrize(
    ("member", "horizon"),
    [
        (OUT_OF_PLANE[0], 1e-6),
        (IN_PLANE[0], 1e-6),
        (IN_PLANE[0], 1e-2),
        (IN_PLANE[0], 40.0 * np.pi),
        (OUT_OF_PLANE[0], 200.0 * np.pi),
    ],
)
def test_short_and_long_horizons(member: Loop, horizon: float) -> None:
    trajectory = solve_batch([member], horizon)
    times = horizon * np.sort(np.concatenate([np.geomspace(1e-6, 1.0, 8), np.linspace(0.05, 0.95, 11)]))
    exact = Reference(member, 18)(times)
    position, control = trajectory(times)[0, :, : member.size], trajectory.control(times)[0]
    assert np.abs(position - exact.position).max() < 1e-8 * np.abs(exact.position).max()
    assert np.abs(control - exact.control).max() < 1e-8 * np.abs(exact.control).max()


@pytest.mark.parametrize("alpha", [1.0, 0.9])
def test_a_free_mass(alpha: float) -> None:
    """k_P = -1 and k_D = 0 leave w'' = 0; k_D > 0 a Mittag-Leffler function with a pole at σ = 0."""
    times = np.array([0.1, 1.0, 9.0])
    trajectory = Contour().solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(-1.0, 0.0, alpha)), np.array([1e-3, 2e-3]), 10.0)
    np.testing.assert_allclose(trajectory(times)[:, 0], 1e-3 + 2e-3 * times, rtol=1e-8)
    assert trajectory.stable.item() is None
    trajectory = Contour().solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(-1.0, 1.5, alpha)), np.array([1e-3, 2e-3]), 10.0)
    exact = [float(series.damped_free_mass(1.5, alpha, 1e-3, 2e-3, t)) for t in times]
    np.testing.assert_allclose(trajectory(times)[:, 0], exact, rtol=1e-7)
    assert trajectory.stable.item() is None


@pytest.mark.parametrize("tolerance", [0.0, -1e-8, 1.0, np.nan])
def test_tolerances_out_of_range_are_refused(tolerance: float) -> None:
    with pytest.raises(ArgumentError, match="`tolerance` must"):
        Contour(tolerance)


@pytest.mark.parametrize("horizon", [0.0, -1.0, np.nan, np.inf])
def test_horizons_out_of_range_are_refused(horizon: float) -> None:
    with pytest.raises(ArgumentError, match="`horizon` must"):
        Contour().solve(closed_loop(OUT_OF_PLANE[:1]), np.array([0.0, 1.0]), horizon)


@pytest.mark.parametrize("time", [-0.1, 6.1, np.nan])
def test_times_outside_the_horizon_are_refused(time: float) -> None:
    trajectory = Contour().solve(closed_loop(OUT_OF_PLANE[:1]), np.array([0.0, 1.0]), 6.0)
    with pytest.raises(ArgumentError, match="`times` must"):
        trajectory([0.0, time])


def test_initial_states_of_wrong_shape_are_refused() -> None:
    with pytest.raises(ArgumentError, match="`initial_state` must"):
        Contour().solve(closed_loop(OUT_OF_PLANE[:1]), np.zeros(3), 6.0)


OVERDAMPED = [20.0, 100.0, 200.0, 1000.0, 1e4]


@pytest.mark.parametrize("size", [1, 2])
def test_overdamped_loops_take_few_nodes(size: int) -> None:
    """Poles at -k_D and -2/k_D do not oscillate, though their radius times the horizon reaches 4e5 rad."""
    horizon, count = 12.0 * np.pi, len(OVERDAMPED)
    plant, gain = (
        (HCWOutOfPlane(), np.ones((1, 1))) if size == 1 else (HCWInPlane(), np.array([[1.0, 0.2], [0.1, 0.7]]))
    )
    k_p, k_d = 4.0 * np.eye(size), np.array(OVERDAMPED)[:, None, None] * gain
    law = PDAlpha(4.0, OVERDAMPED, 1.0) if size == 1 else PDAlpha(np.broadcast_to(k_p, k_d.shape), k_d, 1.0)
    start, times = np.concatenate([np.full(size, 1e-3), np.full(size, 2e-3)]), np.geomspace(1e-6, horizon, 40)
    trajectory = Contour().solve(ClosedLoop(plant, law), start, horizon)
    assert list(trajectory.status) == ["ok"] * count
    assert trajectory.counters["nodes"].max() < 1500
    for i in range(count):
        matrix = np.block([[np.zeros((size, size)), np.eye(size)], [plant.stiffness - k_p, plant.damping - k_d[i]]])
        exact = np.array([expm(matrix * time) @ start for time in times])
        controls = -exact @ np.hstack([k_p, k_d[i]]).T
        both = (trajectory(times)[i, :, :size], exact[:, :size]), (trajectory.control(times)[i], controls)
        for found, wanted in both:
            assert np.abs(found - wanted).max() < 1e-8 * np.abs(wanted).max()


def test_an_overdamped_loop_with_memory() -> None:
    """k_D = 200 at α = 0.9: poles near 124 e^(±0.909 πi), of half the radius of k_D and a third of that high."""
    member = loops.out_of_plane(1.0, 200.0, 0.9, [1e-3, 2e-3])
    trajectory = solve_batch([member], 12.0 * np.pi)
    times = check_times(12.0 * np.pi)
    exact = Reference(member, 16)(times)
    assert trajectory.status[0] == "ok"
    assert np.abs(trajectory(times)[0, :, :1] - exact.position).max() < 1e-8 * np.abs(exact.position).max()
    assert np.abs(trajectory.control(times)[0] - exact.control).max() < 1e-8 * np.abs(exact.control).max()


@pytest.mark.parametrize("k_p", [1e5, 1e8])
def test_too_many_oscillations_are_refused_at_once(k_p: float) -> None:
    """Poles at ±316i and ±1e4 i: the first would take gigabytes, the second more nodes than any design has."""
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, 2.0, 1.0))
    with pytest.raises(UnsupportedError, match="imaginary parts of poles times the horizon reach") as refusal:
        Contour().solve(loop, np.array([0.0, 1.0]), 12.0 * np.pi)
    reached = float(str(refusal.value).split("reach ")[1].split(" rad")[0])
    assert np.sqrt(k_p) * 12.0 * np.pi < reached < 1.5 * np.sqrt(k_p) * 12.0 * np.pi
