"""Limits that belong to a plant, and motions that a control ends."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl import ClosedLoop, solve
from fracctl.controllers import PD, AdaptiveSlidingMode, DelayedFeedback, Saturation
from fracctl.errors import ArgumentError
from fracctl.loop import Need
from fracctl.plants import HCWOutOfPlane, Tether

RELEASE = [0.1, 0.1, 0.1, 0.7, 0.0, 0.0]
NO_LIMITS = Saturation(np.inf)


def test_a_plant_s_limits_hold_without_being_asked_for() -> None:
    loop = ClosedLoop(Tether(), AdaptiveSlidingMode())
    trajectory = solve(loop, RELEASE, 2.0, "implicit_memory")
    tension = 2.55 - trajectory.controls[:, 0]
    assert 0.1 - 1e-12 <= tension.min() < 0.2
    assert np.abs(trajectory.controls[:, 1:]).max() <= 5.0
    assert trajectory.status.tolist() == ["ok"]
    given = ClosedLoop(Tether(), AdaptiveSlidingMode(), Saturation(Tether().limits, "axis"))
    np.testing.assert_array_equal(trajectory.states, solve(given, RELEASE, 2.0, "implicit_memory").states)


def test_own_limits_replace_them_and_infinite_ones_take_them_away() -> None:
    law = AdaptiveSlidingMode()
    own = ClosedLoop(Tether(), law, Saturation([2.0, 1.0, 1.0], "axis"))
    assert own.saturation is not None
    np.testing.assert_array_equal(own.saturation.limit, [[2.0, 1.0, 1.0]])
    assert ClosedLoop(Tether(), law, NO_LIMITS).saturation is None
    assert Need.SATURATION not in ClosedLoop(HCWOutOfPlane(), PD(1.0, 1.0), NO_LIMITS).needs
    assert ClosedLoop(Tether()).saturation is None, "nothing is asked for in free motion"
    with pytest.raises(ArgumentError, match="`limit` must hold finite numbers only, but is inf"):
        Saturation([1.0, np.inf], "axis")


SPEED = np.diag([-10.0, 0.0, 0.0])
"""Feedback of λ' that makes the tension ρ - 10 λ', so that a tether that is let out is pushed."""
LAWS = {
    "explicit_memory": PD(np.zeros((3, 3)), SPEED),
    "implicit_memory": AdaptiveSlidingMode(alpha_1=0.0),
    "method_of_steps": DelayedFeedback(np.hstack([np.zeros((3, 3)), SPEED]), 0.2),
}
STARTS = {
    "explicit_memory": [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.8, 0.3, 0.1, 0.1, 0.0, 0.0]],
    "implicit_memory": [RELEASE, [0.95, 0.3, 0.1, 0.5, 0.0, 0.0]],
    "method_of_steps": [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.8, 0.3, 0.1, 0.1, 0.0, 0.0]],
}


@pytest.mark.parametrize("solver", list(LAWS))
def test_a_tether_that_would_push_is_slack(solver: str) -> None:
    """Its end is where the tension falls through zero; within the plant's limits it does not come to that."""
    plant, law, start = Tether(), LAWS[solver], STARTS[solver]
    bounded = solve(ClosedLoop(plant, law), start, 1.0, solver)
    assert "slack" not in bounded.status
    assert np.isnan(bounded.events["slack"]).all()
    assert plant.rho - np.nanmax(bounded.controls[..., 0]) >= 0.1 - 1e-9
    free = solve(ClosedLoop(plant, law, NO_LIMITS), start, 1.0, solver)
    assert "slack" in free.status
    for i in np.flatnonzero(free.status == "slack"):
        end = free.end[i]
        assert end == free.events["slack"][i]
        if end == 0.0:
            assert free.control([0.0])[i, 0, 0] > plant.rho
            continue
        before = np.linspace(0.0, end, 300)
        tension = plant.rho - free.control(before)[i, :, 0]
        assert tension[:-1].min() > 0.0, "it is the first time"
        assert tension[-1] == pytest.approx(0.0, abs=1e-9)
        assert np.isnan(free([end + 1e-6])[i]).all()
