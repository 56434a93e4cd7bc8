"""Peak acceleration and final distance against closed forms and reference trajectories."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import fracctl as fc
from fracctl.measures.final_distance import FinalDistance
from fracctl.measures.peak_acceleration import PeakAcceleration, peak_acceleration
from tests.references import loops, poles
from tests.references.laplace import QuickReference
from tests.references.loops import Loop
from tests.references.measures import scan_grid
from tests.references.product import solve

HORIZON = 4.0 * np.pi
IN_PLANE = [m for m in loops.random_in_plane(83, 40, spread=2.0) if poles.unstable_count(m) == 0][:8]


def reference_peak(member: Loop) -> float:
    """Largest of |υ_i(0+)|, and of |υ_i| on a dense grid, polished between its neighbours; orders below 1."""
    reference, grid = QuickReference(member), scan_grid(HORIZON)
    peaks = np.abs(member.k_p @ member.start[: member.size]).tolist()
    for i in range(member.size):
        values = np.abs(reference(grid).control[:, i])
        k = int(np.argmax(values))
        ends = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
        best = minimize_scalar(
            lambda s, i=i: -abs(reference(np.array([s])).control[0, i]), bounds=ends, options={"xatol": 1e-10}
        )
        peaks.append(max(values[k], -best.fun))
    return float(max(peaks))


@pytest.mark.parametrize(
    "members", [list(loops.random_out_of_plane(82, 8)), IN_PLANE], ids=["out_of_plane", "in_plane"]
)
def test_peaks_of_random_loops(members: list[Loop]) -> None:
    computed = PeakAcceleration()(solve(members, HORIZON))["peak_acceleration"]
    np.testing.assert_allclose(computed, [reference_peak(member) for member in members], rtol=1e-6)


def test_the_peak_at_the_beginning_counts() -> None:
    """υ(0+) = -k_D w'(0) for PD from w = 0; from there the control falls."""
    loop = fc.ClosedLoop(fc.plants.HCWOutOfPlane(), fc.controllers.PDAlpha(k_p=0.0, k_d=2.0, alpha=1.0))
    trajectory = fc.solve(loop, initial_state=[0.0, 0.002], horizon=HORIZON)
    assert peak_acceleration(trajectory) == pytest.approx(0.004, rel=1e-9)


def test_a_peak_inside() -> None:
    """Undamped, w = 0.001 sin 2s: the control 3 w is largest a quarter of an oscillation after the start."""
    loop = fc.ClosedLoop(fc.plants.HCWOutOfPlane(), fc.controllers.PDAlpha(k_p=3.0, k_d=0.0, alpha=1.0))
    trajectory = fc.solve(loop, initial_state=[0.0, 0.002], horizon=HORIZON)
    assert peak_acceleration(trajectory) == pytest.approx(3.0 * 0.001, rel=1e-8)


def test_final_distance_is_the_last_position() -> None:
    """Critically damped, w = 0.002 s e^(-2s)."""
    loop = fc.ClosedLoop(fc.plants.HCWOutOfPlane(), fc.controllers.PDAlpha(k_p=3.0, k_d=4.0, alpha=1.0))
    trajectory = fc.solve(loop, initial_state=[0.0, 0.002], horizon=2.0)
    assert FinalDistance()(trajectory)["final_distance"][0] == pytest.approx(0.004 * math.exp(-4.0), rel=1e-8)
