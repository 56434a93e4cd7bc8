"""Three independent solvers, and the reference, on random stable gain sets with orders in [0.5, 1).

The contour and the Volterra solver agree within 1e-8 of the peak; fractional Chebyshev collocation converges to both
at its order, 2(2-α) for the largest order α (`tests/orders`), and keeps below its own estimate.
"""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.solvers import Collocation, Contour, Volterra
from fracctl.trajectory import Trajectory
from tests.references import loops, poles
from tests.references.laplace import QuickReference
from tests.references.loops import Loop
from tests.references.product import check_times, closed_loop

WITHIN = 1e-8
Pair = tuple[np.ndarray, np.ndarray]
"""Positions (b, t, m) and controls (b, t, m)."""


def stable_in_plane(seed: int, count: int) -> list[Loop]:
    """Half near the gains of the paper, half from the whole of [-8, 8]."""
    members: list[Loop] = []
    for spread, wanted in ((2.0, count - count // 2), (None, count // 2)):
        found = (m for m in loops.random_in_plane(seed, 40 * count, spread) if poles.unstable_count(m) == 0)
        members += [next(found) for _ in range(wanted)]
    return members


def at(trajectory: Trajectory, times: np.ndarray, size: int) -> Pair:
    return trajectory(times)[..., :size], trajectory.control(times)


def differences(first: Pair, second: Pair, peaks: Pair) -> np.ndarray:
    """Return the larger of the differences of positions and of controls over their peaks, (b,)."""
    parts = [np.abs(a - b).max(axis=(1, 2)) / p for a, b, p in zip(first, second, peaks, strict=True)]
    return np.maximum(*parts)


def check(members: list[Loop], horizon: float) -> None:
    size, times = members[0].size, np.concatenate([check_times(horizon), np.linspace(0.0, horizon, 101)[1:]])
    starts = np.array([member.start for member in members])
    loop = closed_loop(members)
    references = [QuickReference(member)(times) for member in members]
    exact = np.array([r.position for r in references]), np.array([r.control for r in references])
    peaks = np.abs(exact[0]).max(axis=(1, 2)), np.abs(exact[1]).max(axis=(1, 2))
    contour, volterra = Contour().solve(loop, starts, horizon), Volterra().solve(loop, starts, horizon)
    for trajectory in (contour, volterra):
        assert set(trajectory.status) == {"ok"}
        errors = differences(at(trajectory, times, size), exact, peaks)
        assert errors.max() < WITHIN
        assert np.all(errors <= trajectory.error_estimate + 1e-11)
    assert differences(at(contour, times, size), at(volterra, times, size), peaks).max() < WITHIN
    fine, coarse = (Collocation(n).solve(loop, starts, horizon) for n in (128, 64))
    errors, larger = (differences(at(t, times, size), exact, peaks) for t in (fine, coarse))
    resolved = fine.error_estimate < 0.02
    assert resolved.mean() > 0.8
    assert np.all(errors[resolved] <= fine.error_estimate[resolved])
    theory = 2.0 * (2.0 - np.array([member.alpha.max() for member in members]))
    assert np.median(np.log2(larger / errors)[resolved] - theory[resolved]) == pytest.approx(0.0, abs=0.25)


def test_out_of_plane() -> None:
    check(list(loops.random_out_of_plane(301, 20)), 4.0 * np.pi)


def test_in_plane() -> None:
    check(stable_in_plane(302, 20), 4.0 * np.pi)


@pytest.mark.slow
def test_out_of_plane_at_length() -> None:
    check(list(loops.random_out_of_plane(303, 250)), 12.0 * np.pi)


@pytest.mark.slow
def test_in_plane_at_length() -> None:
    check(stable_in_plane(304, 250), 12.0 * np.pi)
