"""The stiff peers solve the problem they are said to solve."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import tethers
from benchmarks.peers.stiff_equations import SciPy, equations


@pytest.fixture(scope="module")
def own() -> np.ndarray:
    return tethers.implicit(tethers.starts(1))


@pytest.mark.parametrize(("method", "allowed"), [("LSODA", 2e-4), ("BDF", 2e-3)])
def test_a_peer_agrees_at_a_loose_tolerance(own: np.ndarray, method: str, allowed: float) -> None:
    found = SciPy(method, 1e-4)(tethers.starts(1), tethers.TIMES)
    assert found.shape == own.shape == (1, len(tethers.TIMES), 6)
    assert np.abs(found - own)[:, 1:, :3].max() < allowed


def test_the_first_of_a_batch_is_the_nominal_release(own: np.ndarray) -> None:
    states = tethers.starts(3)
    np.testing.assert_array_equal(states[0], tethers.START)
    assert np.abs(tethers.implicit(states)[0] - own[0])[:, :3].max() < tethers.ASKED


@pytest.mark.parametrize("moment", [0.0, 0.7, 4.0])
def test_both_right_hand_sides_are_one(moment: float) -> None:
    random = np.random.default_rng(3)
    compiled, first = equations(tethers.START, 12.0, 1e-6)
    written, _ = equations(tethers.START, 12.0, 1e-6, compiled=False)
    state = np.concatenate([[0.6, 0.05, -0.03, 0.2, 0.1, -0.2], [0.1, -0.05, 0.2, 0.3, 0.2], first[11:]])
    state[11:] *= random.uniform(-0.1, 0.1, len(first) - 11)
    np.testing.assert_allclose(written(moment, state), compiled(moment, state), rtol=1e-8, atol=1e-8)
