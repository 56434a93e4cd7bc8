"""Which trajectories a measure takes, and what the trajectories of all solvers share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fracctl import ClosedLoop, measures, solve
from fracctl.config import registry
from fracctl.controllers import AdaptiveSlidingMode, PDAlpha
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.measures.base import OfTrajectories, trajectories_of
from fracctl.plants import HCWOutOfPlane, Libration, Tether
from fracctl.trajectory import AnyTrajectory

HORIZON = 0.5


@pytest.fixture(scope="module")
def trajectories() -> dict[str, AnyTrajectory]:
    law, tether = AdaptiveSlidingMode(), [0.1, 0.1, 0.1, 0.7, 0.0, 0.0]
    found = [
        solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91)), [0.0, 0.002], HORIZON),
        solve(ClosedLoop(Libration()), [0.0, 0.1], HORIZON, "method_of_steps"),
        solve(ClosedLoop(Tether(), law), tether, HORIZON, "implicit_memory"),
    ]
    return {type(trajectory).__name__: trajectory for trajectory in found}


def test_they_share_how_they_are_asked_and_how_they_ended(trajectories: dict[str, AnyTrajectory]) -> None:
    assert sorted(trajectories) == ["MeshTrajectory", "StepwiseTrajectory", "Trajectory"]
    for trajectory in trajectories.values():
        assert isinstance(trajectory, AnyTrajectory)
        assert trajectory.end.tolist() == [HORIZON]
        assert trajectory.status.tolist() == ["ok"]
        assert all(np.isnan(times).all() for times in trajectory.events.values())
        np.testing.assert_array_equal(trajectory.states, trajectory(trajectory.times))
        np.testing.assert_array_equal(trajectory.controls, trajectory.control(trajectory.times))
        assert np.isfinite(trajectory([HORIZON * (1.0 + 1e-13)])).all()
        for ask in (trajectory, trajectory.control):
            with pytest.raises(ArgumentError, match=r"`times` must have shape \(t,\).*, but is of shape \(2, 2\)"):
                ask(np.zeros((2, 2)))
            with pytest.raises(ArgumentError, match=r"`times` must lie in \[0, 0.5\], the solved horizon, but is 0.6"):
                ask([0.1, 0.6])


@pytest.mark.parametrize(
    ("measure", "kind", "sentence"),
    [
        (
            measures.settling_time,
            "StepwiseTrajectory",
            "linear fractional loops, not of the method of steps; .* SettlingPeriods",
        ),
        (
            measures.delta_v,
            "Trajectory",
            "the method of steps, not of linear fractional loops; .*ControlEffort, DeltaV",
        ),
        (measures.length_overshoot, "Trajectory", "laws with a memory in the loop, not of linear fractional loops; "),
        (measures.Tension(), "StepwiseTrajectory", "laws with a memory in the loop, not of the method of steps; "),
        (
            measures.HoldError(),
            "MeshTrajectory",
            "linear fractional loops, not of laws with a memory in the loop; .*Tension",
        ),
        (measures.boundedness.largest_distance, "MeshTrajectory", "the method of steps, not of laws with a memory"),
    ],
)
def test_other_trajectories_are_refused_with_what_measures_them(
    trajectories: dict[str, AnyTrajectory], measure: Callable[[AnyTrajectory], object], kind: str, sentence: str
) -> None:
    with pytest.raises(UnsupportedError, match=f"is made for trajectories of {sentence}"):
        measure(trajectories[kind])


def test_every_measure_of_a_configuration_is_exported_and_says_what_it_takes() -> None:
    for name in registry.names("measures"):
        kind = registry.load("measures", name)
        if not kind.__module__.startswith("fracctl."):
            continue
        assert getattr(measures, kind.__name__) is kind
        assert issubclass(kind, OfTrajectories) or hasattr(kind, "of_loop")
        assert trajectories_of(kind) is not None
