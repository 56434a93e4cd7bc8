"""The strip that holds all poles of loops with lags, against eigenvalues of their first-order forms."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.characteristic.bounds import pole_height, pole_radius
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.controllers import PID
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane
from tests.systems.laws import IN_PLANE, OUT_OF_PLANE, filtered_pid


@pytest.mark.parametrize("m", [1, 2])
def test_pole_height_holds_all_poles(m: int) -> None:
    """Lags from far slower to far faster than the plant; the bound does not grow with 1/T."""
    random, count = np.random.default_rng(m), 400
    shape = (count,) if m == 1 else (count, 2, 2)
    k_p, k_d = random.uniform(-8.0, 8.0, (2, *shape))
    k_i = random.uniform(-2.0, 2.0, shape) * (random.random(count) < 0.5).reshape(-1, *[1] * (len(shape) - 1))
    lag = 10.0 ** random.uniform(-4.0, 1.0, (count,) if m == 1 else (count, 2))
    plant, matrices = (HCWOutOfPlane(), OUT_OF_PLANE) if m == 1 else (HCWInPlane(), IN_PLANE)
    matrix = CharacteristicMatrix(ClosedLoop(plant, PID(k_p, k_i, k_d, lag)).system)
    height = pole_height(matrix, pole_radius(matrix))
    assert height.max() < 30.0
    for i in range(count):
        poles = np.linalg.eigvals(filtered_pid(*matrices, k_p[i], k_i[i], k_d[i], lag[i]).matrix)
        assert np.abs(poles.imag).max() < height[i]


def test_pole_height_of_one_lag() -> None:
    """σ² + 1 + k_P + k_D σ / (T σ + 1): (1 + k_P) / y² + k_D / (T y² + 1 / (4 T)) is 1 there, or k_D / y the second."""
    k_p, k_d, lag = np.array([3.0, 3.0, 1.0]), np.array([4.0, 0.5, 8.0]), np.array([1.0, 2.0, 0.01])
    matrix = CharacteristicMatrix(ClosedLoop(HCWOutOfPlane(), PID(k_p, 0.0, k_d, lag)).system)
    y = pole_height(matrix, pole_radius(matrix))
    for height, tops in ((y, np.less_equal), (y / 1.031, np.greater_equal)):
        slow = k_d / (lag * height**2 + 0.25 / lag)
        total = (1.0 + k_p) / height**2 + np.where(height < 0.5 / lag, k_d / height, slow)
        assert tops(total, 1.0).all()
