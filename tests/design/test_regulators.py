"""Many regulators at once against one at a time, which solves the Riccati equation by another method."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.design import lqr
from fracctl.design.regulators import regulators
from fracctl.errors import ArgumentError
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant


@pytest.mark.parametrize("plant", [HCWInPlane(), HCWOutOfPlane()])
def test_the_gains_of_single_regulators(plant: LinearPlant) -> None:
    random, m = np.random.default_rng(1), plant.n_controls
    q, r = 10.0 ** random.uniform(-2.0, 2.5, (40, 2 * m)), 10.0 ** random.uniform(-2.0, 2.0, (40, m))
    found = regulators(plant, q, r)
    for i in range(40):
        single = lqr(plant, q[i], r[i])
        assert np.abs(found[i] - single).max() < 1e-9 * max(1.0, np.abs(single).max())


def test_the_closed_form_of_an_oscillator() -> None:
    """w'' = -w + υ: k_P = √(1 + q/r) - 1, k_D = √(2 k_P + q'/r)."""
    q, r = np.array([[3.0, 0.5], [8.0, 0.0]]), np.array([[1.0], [0.5]])
    k_p = np.sqrt(1.0 + q[:, 0] / r[:, 0]) - 1.0
    k_d = np.sqrt(2.0 * k_p + q[:, 1] / r[:, 0])
    assert regulators(HCWOutOfPlane(), q, r)[:, 0] == pytest.approx(np.stack([k_p, k_d], axis=1), rel=1e-12)


def test_what_is_not_weighed_and_does_not_die_out() -> None:
    with pytest.raises(ArgumentError, match="must weigh every motion"):
        regulators(HCWOutOfPlane(), np.array([[1.0, 1.0], [0.0, 0.0]]), np.ones((2, 1)))
