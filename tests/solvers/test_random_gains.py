"""No wrong number without a flag: 400 in-plane gain sets uniform in [-8, 8], orders in [0.5, 1], as in the spec.

Verdicts are checked by the argument principle with a proved step and by poles (eigenvalues at α = 1), trajectories by
the reference that takes poles out of the transform.
"""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import PDAlpha
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from fracctl.solvers import Contour
from fracctl.trajectory import Trajectory
from tests.references import loops, poles, series
from tests.references.laplace import QuickReference
from tests.references.loops import Loop
from tests.references.product import check_times, solve

COUNT = 400
TRUSTED = {"ok", "unsettled"}
FLAGGED = {"unstable", "diverged", "failed"}


class Exact:
    """Positions and controls of one member, by the matrix exponential at integer orders."""

    def __init__(self, member: Loop) -> None:
        self.member = member
        self.reference = None if poles.is_integer_order(member) else QuickReference(member)

    def __call__(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.reference is None:
            states, controls = series.matrix_exponential(self.member, times)
            return states[:, : self.member.size], controls
        values = self.reference(times)
        return values.position, values.control


def is_stable(member: Loop) -> bool:
    """Whether no pole lies right of the imaginary axis: eigenvalues at integer orders, otherwise counted."""
    if poles.is_integer_order(member):
        return bool(np.all(np.linalg.eigvals(poles.companion(member)).real < 0))
    return poles.unstable_count(member) == 0


def assert_honest(members: list[Loop], trajectory: Trajectory) -> None:
    """Check verdicts of all members, and trajectories of those that carry no flag."""
    assert set(trajectory.status) <= TRUSTED | FLAGGED
    times, dense = check_times(trajectory.horizon), np.linspace(1e-6, trajectory.horizon, 300)
    computed = trajectory(times), trajectory.control(times)
    for i, member in enumerate(members):
        verdict = is_stable(member)
        assert trajectory.stable[i] is verdict, f"member {i}: {member}"
        assert (trajectory.status[i] in TRUSTED) == verdict, f"member {i}: {trajectory.status[i]}"
        if trajectory.status[i] in TRUSTED:
            exact = Exact(member)
            for values, wanted, everywhere in zip(computed, exact(times), exact(dense), strict=True):
                error = np.abs(values[i, :, : member.size] - wanted).max()
                assert error < 1e-6 * np.abs(everywhere).max(), f"member {i}: {member}"


@pytest.fixture(scope="module")
def random_members() -> list[Loop]:
    """Every tenth has integer orders, every tenth one integer order."""
    members = list(loops.random_in_plane(7, COUNT))
    for i in range(0, COUNT, 10):
        members[i] = members[i].replace(alpha=[1.0, 1.0])
        members[i + 5] = members[i + 5].replace(alpha=[1.0, members[i + 5].alpha[1]])
    return members


@pytest.mark.parametrize("horizon", [4.0 * np.pi, pytest.param(12.0 * np.pi, marks=pytest.mark.slow)])
def test_random_gains_and_orders(random_members: list[Loop], horizon: float) -> None:
    assert_honest(random_members, solve(random_members, horizon))


def test_random_gains_that_share_their_orders() -> None:
    members = [m.replace(alpha=[0.93, 0.71]) for m in loops.random_in_plane(8, 80)]
    members += [m.replace(alpha=[0.93, 0.71]) for m in loops.random_in_plane(9, 40, spread=2.5)]
    trajectory = Contour().solve(
        ClosedLoop(
            HCWInPlane(),
            PDAlpha(np.array([m.k_p for m in members]), np.array([m.k_d for m in members]), [0.93, 0.71]),
        ),
        np.array([m.start for m in members]),
        12.0 * np.pi,
    )
    assert_honest(members, trajectory)


def test_mild_gains_with_a_stable_majority() -> None:
    members = list(loops.random_in_plane(10, 80, spread=2.0))
    assert_honest(members, solve(members, 12.0 * np.pi))


@pytest.mark.slow
def test_unstable_loops_keep_their_trajectory_where_they_have_one(random_members: list[Loop]) -> None:
    """A growing solution, if given, is right to 1e-6 of its peak; otherwise it is NaN and called diverged."""
    horizon = 4.0 * np.pi
    trajectory = solve(random_members, horizon)
    times = np.linspace(0.1, horizon, 20)
    states = trajectory(times)
    for i, member in enumerate(random_members):
        if trajectory.status[i] == "diverged":
            assert np.isnan(states[i]).any()
        elif trajectory.status[i] == "unstable":
            exact = Exact(member)(times)[0]
            assert np.abs(states[i, :, :2] - exact).max() < 1e-6 * np.abs(exact).max()


def test_extreme_gains_are_honest() -> None:
    """Gains and orders far outside the survey: tiny and huge, nearly critical, nearly undamped."""
    table = [
        (1e-6, 1e-6, 0.9),
        (0.0, 1e-3, 0.5),
        (100.0, 0.01, 0.7),
        (1e3, 50.0, 0.95),
        (0.5, 300.0, 0.6),
        (1.0, 2.0 * np.sqrt(2.0), 0.999999),
        (0.0, 2.0, 0.01),
        (-0.999, 0.5, 0.8),
        (2.0, -0.05, 0.9),
        (-1.5, 1.0, 0.9),
    ]
    members = [loops.out_of_plane(*row, [1e-3, -2e-3]) for row in table]
    trajectory = solve(members, 12.0 * np.pi)
    assert [bool(s) for s in trajectory.stable] == [True] * 8 + [False] * 2
    times = check_times(12.0 * np.pi)
    states = trajectory(times)
    for i, member in enumerate(members[:8]):
        exact = Exact(member)(times)[0]
        error = np.abs(states[i, :, :1] - exact).max() / np.abs(exact).max()
        assert error < 1e-7 or trajectory.status[i] == "failed", f"{table[i]}: {error}, {trajectory.status[i]}"
    assert "failed" not in trajectory.status


def test_every_positive_gain_is_stable_out_of_plane() -> None:
    """On σ = iω the imaginary part of det M is k_D ω^α sin(απ/2) > 0 for k_P, k_D > 0."""
    generator = np.random.default_rng(12)
    k_p, k_d, alpha = (
        generator.uniform(1e-3, 8.0, 200),
        generator.uniform(1e-3, 8.0, 200),
        generator.uniform(0.02, 1, 200),
    )
    trajectory = Contour().solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, alpha)), np.array([1e-3, 0.0]), 4.0)
    assert all(verdict is True for verdict in trajectory.stable)


def test_two_pole_pairs_close_together_do_not_hide() -> None:
    """Gains that decouple u and v into two equal, weakly damped oscillators: arg det M turns by 2π at once."""
    k_d = np.array([1e-2, -1e-2, 1e-4, -1e-4])
    gains = np.array([[4.0, 0.0, 0.0, 2.0], [0.0, 1.0, -2.0, 0.0]])
    members = [loops.in_plane(gains + d * np.eye(2, 4, 2), [1.0, 1.0], [1e-3, 0.0, 0.0, 0.0]) for d in k_d]
    trajectory = solve(members, 12.0 * np.pi)
    assert list(trajectory.stable) == [True, False, True, False]
