"""Measures on uniform samples, against plain NumPy on the trajectory's own states and controls."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.errors import ArgumentError
from fracctl.measures import ControlEffort, Overshoot, control_effort, overshoot
from fracctl.measures.samples import MOST_SAMPLES, Samples, samples_of
from fracctl.panels import PanelGrid
from tests.references import loops, poles
from tests.references.laplace import QuickReference
from tests.references.loops import Floats
from tests.references.product import solve

HORIZON = 12.0 * np.pi
OUT_OF_PLANE = list(loops.random_out_of_plane(83, 150))
IN_PLANE = [m for m in loops.random_in_plane(84, 40, spread=2.0) if poles.unstable_count(m) == 0][:12]
BATCHES = pytest.mark.parametrize("members", [OUT_OF_PLANE, IN_PLANE], ids=["out_of_plane", "in_plane"])
RESOLUTIONS = pytest.mark.parametrize("resolution", [0.01, 0.037, 0.5])


def samples(resolution: float) -> Floats:
    return np.arange(0.0, HORIZON, resolution)


@BATCHES
@RESOLUTIONS
def test_control_effort_is_the_trapezoidal_rule(members: list[loops.Loop], resolution: float) -> None:
    trajectory = solve(members, HORIZON)
    times = samples(resolution)
    expected = np.trapezoid(np.abs(trajectory.control(times)), times, axis=1).sum(axis=1)
    computed = ControlEffort(resolution)(trajectory)["control_effort"]
    np.testing.assert_allclose(computed, expected, rtol=1e-12)


@BATCHES
@RESOLUTIONS
def test_overshoot_is_the_largest_sample(members: list[loops.Loop], resolution: float) -> None:
    trajectory = solve(members, HORIZON)
    m = members[0].size
    positions = trajectory(samples(resolution))[:, :, :m]
    side = -np.sign(positions[:, :1])
    past = np.where(side == 0.0, np.abs(positions), side * positions).max(axis=1).clip(min=0.0)
    computed = Overshoot(resolution=resolution)(trajectory)["overshoot"]
    np.testing.assert_allclose(computed, 1.0 + 1e4 * past.mean(axis=1), rtol=1e-12)


@BATCHES
def test_largest_extremum_among_samples(members: list[loops.Loop]) -> None:
    trajectory = solve(members, HORIZON)
    m = members[0].size
    magnitudes = np.abs(trajectory(samples(0.01))[:, :, :m])
    inner = magnitudes[:, 1:-1]
    tops = (inner >= magnitudes[:, :-2]) & (inner >= magnitudes[:, 2:])
    expected = 1.0 + 1e4 * np.max(inner, axis=1, where=tops, initial=0.0).mean(axis=1)
    computed = Overshoot("largest_extremum", resolution=0.01)(trajectory)["overshoot"]
    np.testing.assert_allclose(computed, expected, rtol=1e-12)


@BATCHES
def test_samples_lie_below_the_extrema_and_come_close(members: list[loops.Loop]) -> None:
    trajectory = solve(members, HORIZON)
    for definition in ("past_equilibrium", "largest_extremum"):
        exact, sampled = (Overshoot(definition, resolution=r)(trajectory)["overshoot"] for r in (None, 0.01))
        assert np.all(sampled <= exact + 1e-9)
        assert np.mean(sampled > exact * (1.0 - 2e-4)) > 0.98, "but for extrema before the first sample"


def test_the_start_of_the_control_counts() -> None:
    """At α = 1 υ(0+) = -k_D w₀' is the largest sample; at α < 1 υ(0+) = 0 and the sum falls short of the integral."""
    integer, fractional = (
        solve([loops.out_of_plane(0.85, 2.0, alpha, [0.0, 0.002])], HORIZON) for alpha in (1.0, 0.91)
    )
    assert integer.initial_controls[0, 0] == pytest.approx(-0.004)
    assert fractional.initial_controls[0, 0] == 0.0
    exact, sampled = (ControlEffort(r)(integer)["control_effort"][0] for r in (None, 0.01))
    assert sampled == pytest.approx(exact, rel=1e-4)
    exact, sampled = (ControlEffort(r)(fractional)["control_effort"][0] for r in (None, 0.01))
    assert sampled / exact - 1.0 == pytest.approx(-0.0044, abs=1e-4)


def test_control_effort_of_the_published_optimum() -> None:
    """IC1, α = 0.91, k = (0.85, 2.0), trapezoidal rule on samples 0.01 apart of the reference trajectory."""
    member = loops.out_of_plane(0.85, 2.0, 0.91, [0.0, 0.002])
    times = samples(0.01)
    magnitudes = np.abs(QuickReference(member)(times[1:]).control[:, 0])
    expected = np.trapezoid(np.concatenate([[0.0], magnitudes]), times)
    assert expected == pytest.approx(2.638004e-3, abs=5e-10)
    assert ControlEffort(0.01)(solve([member], HORIZON))["control_effort"][0] == pytest.approx(expected, rel=1e-8)


def test_a_single_trajectory_gives_a_number() -> None:
    trajectory = solve(OUT_OF_PLANE[:1], HORIZON)
    batch = {**ControlEffort(0.01)(trajectory), **Overshoot(resolution=0.01)(trajectory)}
    assert control_effort(trajectory, 0.01)[0] == batch["control_effort"][0]  # type: ignore[index]
    assert overshoot(trajectory, resolution=0.01)[0] == batch["overshoot"][0]  # type: ignore[index]


def test_a_step_longer_than_the_horizon_sees_the_start_only() -> None:
    trajectory = solve([loops.out_of_plane(0.55, 2.0, 1.0, [1e-3, 0.0])], 2.0)
    assert ControlEffort(3.0)(trajectory)["control_effort"][0] == 0.0
    assert Overshoot(resolution=3.0)(trajectory)["overshoot"][0] == 1.0
    assert Overshoot("largest_extremum", resolution=3.0)(trajectory)["overshoot"][0] == 1.0


def test_a_trajectory_that_does_not_exist_is_infinite() -> None:
    trajectory = solve(OUT_OF_PLANE[:3], HORIZON)
    trajectory.positions[1] = trajectory.controls_at_nodes[1] = np.nan
    for measure in (ControlEffort(0.01), Overshoot(resolution=0.01)):
        (values,) = measure(trajectory).values()
        assert np.isfinite(values).tolist() == [True, False, True]


def test_refusals() -> None:
    for measure in (ControlEffort, Overshoot):
        with pytest.raises(ArgumentError, match="`resolution` must be positive"):
            measure(resolution=0.0)
    grid = solve(OUT_OF_PLANE[:1], 1.0).grid
    with pytest.raises(ArgumentError, match=f"at most {MOST_SAMPLES} samples"):
        Samples(grid, 1e-9)


def test_equal_panels_share_their_samples() -> None:
    panels = solve(OUT_OF_PLANE[:1], HORIZON).grid.panels
    one, two = PanelGrid(panels), PanelGrid(panels)
    assert samples_of(one, 0.01) is samples_of(two, 0.01)
    assert samples_of(one, 0.01) is not samples_of(one, 0.02)
    assert samples_of(one, 0.01) is not samples_of(PanelGrid(panels[:-1]), 0.01)


def test_many_samples_are_not_kept() -> None:
    grid = solve(OUT_OF_PLANE[:1], HORIZON).grid
    assert samples_of(grid, 1e-3) is not samples_of(grid, 1e-3)
