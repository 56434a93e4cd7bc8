"""Surveys, the way grids are computed: every member from several starts, in groups on grids of their own."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import PDAlpha
from fracctl.loop import ClosedLoop
from fracctl.measures import ControlEffort, Overshoot, SettlingTime
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from fracctl.solvers import Contour
from tests.references import loops, poles
from tests.references.laplace import QuickReference
from tests.references.loops import Loop
from tests.references.measures import ReferenceMeasures
from tests.references.product import check_times, closed_loop

HORIZON = 12.0 * np.pi
COLUMNS = (SettlingTime(), Overshoot(), ControlEffort())


def surveyed(loop: ClosedLoop, states: np.ndarray) -> dict[str, np.ndarray]:
    """Return measures, status and verdict as (k, b), in the order of the batch."""
    k, b = len(states), loop.batch or 1
    table = {name: np.full((k, b), np.nan) for name in ("settling_time", "overshoot", "control_effort")}
    table |= {name: np.empty((k, b), dtype=object) for name in ("status", "stable")}
    seen = np.zeros(b, dtype=int)
    for part in Contour().survey(loop, states, HORIZON):
        seen[part.rows] += 1
        columns = {name: values for measure in COLUMNS for name, values in measure(part.trajectory).items()}
        for name, values in (columns | {"status": part.trajectory.status, "stable": part.trajectory.stable}).items():
            table[name][:, part.rows] = np.reshape(values, (k, len(part.rows)))
    assert np.all(seen == 1)
    return table


@pytest.mark.parametrize("orders", ["shared", "own"])
def test_trajectories_and_measures_of_a_survey(orders: str) -> None:
    members = list(loops.random_in_plane(90, 60, spread=3.0))
    if orders == "shared":
        members = [m.replace(alpha=[0.95, 0.7]) for m in members]
        law = PDAlpha(np.array([m.k_p for m in members]), np.array([m.k_d for m in members]), [0.95, 0.7])
        loop = ClosedLoop(HCWInPlane(), law)
    else:
        loop = closed_loop(members)
    states = np.array([loops.initial_state(name, "uv") for name in ("ic1", "ic2", "ic3")])
    table = surveyed(loop, states)
    for i, member in enumerate(members):
        stable = poles.unstable_count(member) == 0
        assert all(verdict is stable for verdict in table["stable"][:, i])
        assert all((word == "ok") == stable for word in table["status"][:, i])
        if stable and i % 9 == 0:
            for k, start in enumerate(states):
                reference = ReferenceMeasures(QuickReference(member.replace(start=start)), HORIZON)
                assert table["settling_time"][k, i] == pytest.approx(reference.settling_time(), rel=1e-5)
                assert table["overshoot"][k, i] == pytest.approx(reference.overshoot(), rel=1e-7)
                assert table["control_effort"][k, i] == pytest.approx(reference.control_effort(), rel=1e-7)


def test_survey_trajectories_equal_solve() -> None:
    members = list(loops.random_out_of_plane(91, 30))
    loop, times = closed_loop(members), check_times(HORIZON)
    states = np.array([[0.0, 0.002], [-1e-3, 0.0]])
    for part in Contour().survey(loop, states, HORIZON):
        values, controls = part.trajectory(times), part.trajectory.control(times)
        for place, row in enumerate(part.rows):
            for k, start in enumerate(states):
                exact = QuickReference(members[row].replace(start=start))(times)
                i = k * len(part.rows) + place
                assert np.abs(values[i, :, 0] - exact.position[:, 0]).max() < 1e-8 * np.abs(exact.position).max()
                assert np.abs(controls[i] - exact.control).max() < 1e-8 * np.abs(exact.control).max()


def grid(alpha: float) -> tuple[ClosedLoop, np.ndarray, np.ndarray]:
    """Return the 41 × 41 gains of the paper's out-of-plane survey."""
    k_p, k_d = (a.ravel() for a in np.meshgrid(np.arange(41) / 20.0, np.arange(41) / 20.0, indexing="ij"))
    return ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, alpha)), k_p, k_d


@pytest.mark.parametrize(
    ("name", "alpha", "k_p", "k_d", "settling"),
    [
        ("ic1", 1.0, 0.55, 2.0, 3.96958),
        ("ic1", 0.91, 0.85, 2.0, 3.01276),
        ("ic2", 1.0, 0.45, 2.0, 3.52011),
        ("ic2", 0.97, 0.75, 1.95, 2.76466),
        ("ic3", 1.0, 1.05, 2.0, 3.58862),
    ],
)
def test_published_optima_of_settling_time(name: str, alpha: float, k_p: float, k_d: float, settling: float) -> None:
    """The least ST on the paper's grid."""
    loop, all_p, all_d = grid(alpha)
    times = surveyed(loop, loops.initial_state(name, "w")[None])["settling_time"][0]
    best = int(np.argmin(times))
    assert (all_p[best], all_d[best]) == (k_p, k_d)
    assert times[best] == pytest.approx(settling, abs=5.1e-6)


def test_grid_rows_are_right_where_they_are_not_optimal() -> None:
    """A sample of the grid at α = 0.91 from three starts; k_D = 0 is marginal, everything else stable."""
    loop, k_p, k_d = grid(0.91)
    states = np.array([loops.initial_state(name, "w") for name in ("ic1", "ic2", "ic3")])
    table = surveyed(loop, states)
    assert all((verdict is None) == (gain == 0.0) for verdict, gain in zip(table["stable"][0], k_d, strict=True))
    assert all(verdict is True for verdict, gain in zip(table["stable"][0], k_d, strict=True) if gain > 0)
    for i in np.random.default_rng(92).choice(np.flatnonzero(k_d), 12, replace=False):
        for k, start in enumerate(states):
            member: Loop = loops.out_of_plane(k_p[i], k_d[i], 0.91, start)
            reference = ReferenceMeasures(QuickReference(member), HORIZON)
            assert table["settling_time"][k, i] == pytest.approx(reference.settling_time(), rel=1e-6)
            assert table["overshoot"][k, i] == pytest.approx(reference.overshoot(), rel=1e-6)
            assert table["control_effort"][k, i] == pytest.approx(reference.control_effort(), rel=1e-7)


def test_one_hopeless_member_does_not_spoil_a_survey() -> None:
    """A gain so high that its oscillations cannot be resolved is a flagged row; its neighbours are solved."""
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha([0.85, 1e8, 0.55], [2.0, 0.01, 2.0], 0.91))
    table = surveyed(loop, np.array([[0.0, 0.002]]))
    assert list(table["status"][0]) == ["ok", "failed", "ok"]
    assert table["settling_time"][0, 0] == pytest.approx(3.01276, abs=5.1e-6)
