"""The delayed peers solve the problem they are said to solve."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import delays, orbits


def test_the_truth_and_the_method_of_steps_agree() -> None:
    rows = orbits.gains(3)
    np.testing.assert_array_equal(rows[0], orbits.GAINS)
    np.testing.assert_allclose(delays.stepped(rows, 100)[1], orbits.truth(rows[1]), rtol=0, atol=1e-10)
    assert np.abs(delays.stepped(rows)[0] - orbits.truth(rows[0])).max() < delays.ASKED


def test_jitcdde_converges_to_the_truth() -> None:
    pytest.importorskip("jitcdde", reason="extra `bench` is not installed")
    from benchmarks.peers.delay_equations import JitcDDE

    exact = orbits.truth(orbits.GAINS)
    errors = [np.abs(JitcDDE(tolerance)(orbits.GAINS[None])[0] - exact).max() for tolerance in (1e-6, 1e-9)]
    assert errors[1] < 1e-5
    assert errors[1] < 0.01 * errors[0]
