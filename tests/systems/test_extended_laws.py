"""Loops with auxiliary states and integrals against matrix exponentials of their first-order form."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from fracctl import stability
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWOutOfPlane
from fracctl.solvers import Contour
from tests.references.product import check_times
from tests.systems.laws import PID, Lag

LAWS = [Lag(k_p=0.5, k_d=2.0, time=0.3), Lag(k_p=2.0, k_d=0.5, time=2.0), PID(k_p=1.0, k_d=2.0, k_i=0.7)]
START = np.array([1e-3, 2e-3])


@pytest.mark.parametrize("law", LAWS)
def test_trajectory_and_control(law: Lag | PID) -> None:
    horizon = 20.0
    trajectory = Contour().solve(ClosedLoop(HCWOutOfPlane(), law), START, horizon)
    times = check_times(horizon)
    exact = np.array([scipy.linalg.expm(law.companion() * t) @ [*START, 0.0] for t in times])
    controls = exact @ (law.companion()[1] + [1.0, 0.0, 0.0])
    n = trajectory(times).shape[1]
    assert n == (3 if isinstance(law, Lag) else 2)
    assert np.all(np.abs(trajectory(times) - exact[:, :n]).max(axis=0) < 1e-8 * np.abs(exact[:, :n]).max(axis=0))
    assert np.abs(trajectory.control(times)[:, 0] - controls).max() < 1e-8 * np.abs(controls).max()
    assert trajectory.status.item() == "ok"
    assert trajectory.stable.item() is True


@pytest.mark.parametrize("law", [*LAWS, PID(k_p=0.0, k_d=0.1, k_i=2.0)])
def test_poles_are_eigenvalues(law: Lag | PID) -> None:
    verdict = stability.assess(ClosedLoop(HCWOutOfPlane(), law))
    expected = np.linalg.eigvals(law.companion())
    np.testing.assert_allclose(np.sort_complex(verdict.poles), np.sort_complex(expected), atol=1e-9)
    assert verdict.stable is bool(np.all(expected.real < 0))
