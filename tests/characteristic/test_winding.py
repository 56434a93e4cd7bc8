"""Counts of the argument principle for whole batches, and the bounds on poles, against reference poles."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.characteristic import CharacteristicMatrix, abscissa_bound, principal_poles, unstable_zeros
from fracctl.characteristic.bounds import pole_radius
from fracctl.errors import ArgumentError
from tests.references import loops, poles
from tests.references.loops import Loop
from tests.references.product import closed_loop


@pytest.fixture(scope="module")
def members() -> list[Loop]:
    return [*loops.random_in_plane(70, 120), *loops.random_in_plane(71, 60, spread=2.0)]


def test_counts_of_a_batch(members: list[Loop]) -> None:
    zeros, marginal = unstable_zeros(CharacteristicMatrix(closed_loop(members).system))
    assert not marginal.any()
    np.testing.assert_array_equal(zeros, [poles.unstable_count(member) for member in members])


def test_counts_of_a_batch_out_of_plane() -> None:
    members = [m.replace(k_d=-m.k_d if i % 3 == 0 else m.k_d) for i, m in enumerate(loops.random_out_of_plane(72, 60))]
    zeros, marginal = unstable_zeros(CharacteristicMatrix(closed_loop(members).system))
    assert not marginal.any()
    np.testing.assert_array_equal(zeros, [poles.unstable_count(member) for member in members])


def test_pole_radius_holds_all_poles(members: list[Loop]) -> None:
    radius = pole_radius(CharacteristicMatrix(closed_loop(members).system))
    for member, bound in zip(members, radius, strict=True):
        assert np.abs(poles.poles(member)).max() < bound


def test_abscissa_bound_lies_just_right_of_the_rightmost_pole(members: list[Loop]) -> None:
    unstable = [member for member in members if poles.unstable_count(member)]
    bound = abscissa_bound(CharacteristicMatrix(closed_loop(unstable).system), 0.05)
    for member, value in zip(unstable, bound, strict=True):
        assert 0.0 <= value - poles.poles(member).real.max() <= 0.05


def test_determinant_is_that_of_the_written_out_matrix(members: list[Loop]) -> None:
    sigma = np.array([0.3 + 2.0j, -1.0 + 0.2j, 4.0 - 1.0j])
    values = CharacteristicMatrix(closed_loop(members).system).determinant(sigma)
    expected = [poles.characteristic(member, np.log(sigma)) / sigma**4 for member in members]
    np.testing.assert_allclose(values, expected, rtol=1e-12)


def test_principal_poles_refuse_a_batch(members: list[Loop]) -> None:
    with pytest.raises(ArgumentError, match="must belong to a single loop"):
        principal_poles(CharacteristicMatrix(closed_loop(members[:2]).system))
