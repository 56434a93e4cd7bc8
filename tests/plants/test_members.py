"""Plants that are another for each member: every solver gives each the motion that it has alone."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl import ClosedLoop, solve
from fracctl.controllers import PDAlpha, Saturation
from fracctl.errors import ArgumentError
from fracctl.plants import PerturbedRelativeMotion, RelativeMotion, StatePlant, Tether, TschaunerHempel
from fracctl.sampled import SampledLaw, Window, simulate
from fracctl.solvers import MethodOfSteps

START = np.array([1e-3, 2e-3, 5e-4, 0.0, 1e-3, 0.0])
FOLLOWERS = [0.01, 0.3, 0.9]
DRAGGED = PerturbedRelativeMotion(density_kg_m3=1e-11)
LAW = PDAlpha(0.5 * np.eye(3), np.eye(3), 0.9)
PLANTS = [
    (
        DRAGGED.dispersed_by(follower_ballistic_m2_kg=FOLLOWERS),
        [DRAGGED.dispersed_by(follower_ballistic_m2_kg=[c]) for c in FOLLOWERS],
    ),
    (
        RelativeMotion().dispersed_by([0.0, 0.1, 0.2], [0.0, 40.0, -70.0]),
        [RelativeMotion(None, e, f) for e, f in ((0.0, 0.0), (0.1, 40.0), (0.2, -70.0))],
    ),
    (
        TschaunerHempel().dispersed_by([0.0, 0.1, 0.2]),
        [TschaunerHempel(None, e) for e in (0.0, 0.1, 0.2)],
    ),
    (
        Tether().dispersed_by([0.0, 1.0, 2.0], [1.0, -1.0, 3.0]),
        [Tether().dispersed_by(phase, factor) for phase, factor in ((0.0, 1.0), (1.0, -1.0), (2.0, 3.0))],
    ),
]
NAMES = ["perturbed", "nonlinear", "linear", "tether"]


def start_of(plant: StatePlant) -> np.ndarray:
    return np.array([0.9, 0.1, 0.1, 0.0, 0.0, 0.0]) if isinstance(plant, Tether) else START


@pytest.mark.parametrize(("together", "alone"), PLANTS, ids=NAMES)
def test_rows_are_those_of_members(together: StatePlant, alone: list[StatePlant]) -> None:
    t, x, u = np.linspace(0.1, 2.0, 3), np.tile(start_of(together), (3, 1)), np.zeros((3, 3))
    expected = np.concatenate([plant.rates(t[i : i + 1], x[:1], u[:1]) for i, plant in enumerate(alone)])
    np.testing.assert_array_equal(together.rates(t, x, u), expected)
    which = np.array([2, 0, 2, 1])
    np.testing.assert_array_equal(
        together.take(which).rates(t[which], np.tile(x[0], (4, 1)), np.zeros((4, 3))),  # type: ignore[attr-defined]
        expected[which],
    )
    assert together.batch == 3  # type: ignore[attr-defined]
    for count in (1, 2, 4, 6):
        with pytest.raises(ArgumentError, match=f"a row for each member of the plant, 3, but is a batch of {count}"):
            together.rates(np.zeros(count), np.tile(x[0], (count, 1)), np.zeros((count, 3)))


@pytest.mark.parametrize(("together", "alone"), PLANTS, ids=NAMES)
@pytest.mark.parametrize("limit", [None, 2e-4])
def test_explicit_memory(together: StatePlant, alone: list[StatePlant], limit: float | None) -> None:
    """With a limit members are refined by themselves; the law, the limit and the start are not batched."""
    saturation = None if limit is None else Saturation(limit, "axis")
    found = solve(ClosedLoop(together, LAW, saturation), start_of(together), 1.0, "explicit_memory")([0.7, 1.0])
    assert found.shape == (3, 2, 6)
    for i, plant in enumerate(alone):
        one = solve(ClosedLoop(plant, LAW, saturation), start_of(plant), 1.0, "explicit_memory")
        np.testing.assert_allclose(found[i], one([0.7, 1.0]), rtol=0, atol=1e-8)
    assert np.abs(found[1] - found[0]).max() > 1e-7


def test_free_motion_with_steps_of_a_member_s_own() -> None:
    """Few steps are enough on the circle, and too few at e = 0.7, the second of three."""
    eccentricities = [0.0, 0.7, 0.05]
    together = RelativeMotion().dispersed_by(eccentricities)
    found = MethodOfSteps(24).solve(ClosedLoop(together), START, 6.0)
    assert found.counters["steps"][1] > 1.5 * found.counters["steps"][0]
    for i, e in enumerate(eccentricities):
        one = MethodOfSteps(200).solve(ClosedLoop(RelativeMotion(None, e)), START, 6.0)
        np.testing.assert_allclose(found([6.0])[i], one([6.0]), rtol=0, atol=1e-6 * np.abs(one.states).max())


def test_sampled_flights_from_one_start() -> None:
    together, alone = PLANTS[1]
    law = SampledLaw(LAW, Window(20), 0.05)
    found = simulate(together, law, START, 1.0)
    assert found.states.shape[0] == 3
    for i, plant in enumerate(alone):
        np.testing.assert_array_equal(found.states[i], simulate(plant, law, START, 1.0).states)
    with pytest.raises(ArgumentError, match="must have the batch size of the plant, 3, but is a batch of 2"):
        simulate(together, law, [START] * 2, 1.0)


def test_sizes_that_do_not_fit_are_refused() -> None:
    plant = PLANTS[0][0]
    with pytest.raises(
        ArgumentError, match="one batch size with the plant and the limits, but is in a loop of batches of 2 and 3"
    ):
        ClosedLoop(plant, PDAlpha([np.eye(3)] * 2, np.eye(3)))
    with pytest.raises(ArgumentError, match="must have the batch size of the loop, 3, but is a batch of 2"):
        solve(ClosedLoop(plant, LAW), [START] * 2, 1.0, "explicit_memory")
