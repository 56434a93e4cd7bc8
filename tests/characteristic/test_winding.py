"""Counts of the argument principle for whole batches, and the bounds on poles, against reference poles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.optimize import brentq

from fracctl.characteristic import CharacteristicMatrix, abscissa_bound, principal_poles, unstable_zeros
from fracctl.characteristic.bounds import pole_radius
from fracctl.controllers import LinearLawTerms, PDAlpha, PILambdaDMu
from fracctl.errors import ArgumentError
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant
from tests.references import loops, poles
from tests.references.loops import Loop
from tests.references.product import closed_loop


@dataclass(frozen=True)
class TwoOrders:
    """υ = -c ξ - k₁ D^1.5 ξ - k₂ D^0.5 ξ of one coordinate, all (b,)."""

    c: np.ndarray
    k1: np.ndarray
    k2: np.ndarray

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        gains = ((self.c, 0.0), (self.k1, 1.5), (self.k2, 0.5))
        return LinearLawTerms(
            tuple(FractionalTerm(-k[:, None, None], np.full(n_controls, order)) for k, order in gains)
        )


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


def characteristic(
    plant: LinearPlant, k_p: np.ndarray, k_d: np.ndarray, alpha: float | list[float]
) -> CharacteristicMatrix:
    return CharacteristicMatrix(ClosedLoop(plant, PDAlpha(k_p, k_d, alpha)).system)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5])
def test_counts_at_integer_orders_are_those_of_eigenvalues(size: int) -> None:
    generator = np.random.default_rng(size)
    k_p, k_d = generator.uniform(-6.0, 6.0, (2, 100, size, size))
    k_p, k_d = k_p + 6.0 * np.eye(size), k_d + 6.0 * np.eye(size)
    zeros, marginal = unstable_zeros(characteristic(LinearPlant(np.zeros((size, size))), k_p, k_d, 1.0))
    eye = np.broadcast_to(np.eye(size), k_p.shape)
    companion = np.block([[np.zeros_like(eye), eye], [-k_p, -k_d]])
    assert not marginal.any()
    np.testing.assert_array_equal(zeros, (np.linalg.eigvals(companion).real > 0.0).sum(axis=1))
    assert len(set(zeros)) > 2 or size == 1


@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("alpha", [1.0, 0.9])
def test_weakly_damped_pairs_close_together_in_coupled_coordinates(size: int, alpha: float) -> None:
    """T diag(ω²) T⁻¹ and d T diag(ω) T⁻¹: all pairs cross the axis, or none, and turn the phase by 2π each at once."""
    generator = np.random.default_rng(10 * size)
    batch = 200
    frequencies = 10.0 ** generator.uniform(-2.0, 1.0, (batch, 1)) * (
        1.0 + 10.0 ** generator.uniform(-9.0, -1.0, (batch, 1)) * generator.uniform(0.0, 1.0, (batch, size))
    )
    damping = 10.0 ** generator.uniform(-7.0, -1.0, batch) * generator.choice([-1.0, 1.0], batch)
    modes = np.linalg.qr(generator.normal(size=(batch, size, size)))[0]
    k_p, k_d = (
        modes @ (values[:, :, None] * modes.swapaxes(1, 2))
        for values in (frequencies**2, damping[:, None] * frequencies)
    )
    zeros, marginal = unstable_zeros(characteristic(LinearPlant(np.zeros((size, size))), k_p, k_d, alpha))
    assert not marginal[np.abs(damping) ** size > 1e-12].any(), "the determinant stands out from rounding"
    expected = np.where(damping < 0.0, 2.0 * size, 0.0)
    np.testing.assert_array_equal(zeros[~marginal], expected[~marginal])


def test_zeros_close_to_the_origin_are_counted() -> None:
    """σ² + k σ^α + c with k < 0 < c: two zeros with Re σ > 0, however small, as Im < 0 on the upper axis."""
    generator = np.random.default_rng(3)
    c, k = 10.0 ** generator.uniform(-11.0, 0.0, 400), -(10.0 ** generator.uniform(-11.0, 0.0, 400))
    for alpha in (0.05, 0.5, 0.9, 1.0):
        zeros, marginal = unstable_zeros(characteristic(LinearPlant(0.0), c, k, alpha))
        assert not marginal.any()
        np.testing.assert_array_equal(zeros, 2.0)


@pytest.mark.parametrize("alpha", [0.3, 0.9, 1.0])
def test_counts_of_one_coordinate_by_its_signs(alpha: float) -> None:
    """Descartes' rule for σ² + k σ^α + c: one real zero for c < 0; for c > 0 two zeros on the right if k < 0."""
    k, c = np.array([2.0, 2.0, -2.0, -2.0, 1e-18]), np.array([3.0, -3.0, 3.0, -3.0, 3.0])
    zeros, marginal = unstable_zeros(characteristic(LinearPlant(0.0), c, k, alpha))
    assert not marginal.any()
    np.testing.assert_array_equal(zeros, [0.0, 1.0, 2.0, 1.0, 0.0])
    members = [loops.out_of_plane(p - 1.0, d, alpha, np.zeros(2)) for p, d in zip(c[:4], k[:4], strict=True)]
    np.testing.assert_array_equal(zeros[:4], [poles.unstable_count(member) for member in members])


def test_terms_of_different_signs_in_one_coordinate() -> None:
    """σ² + k₁ σ^1.5 + k₂ σ^0.5 + c with k₁ k₂ < 0: Im M changes its sign, so that the path has to decide."""
    generator = np.random.default_rng(6)
    k1, k2, c = generator.uniform(0.1, 3.0, (3, 200)) * np.array([1.0, -1.0, 1.0])[:, None]
    zeros, marginal = unstable_zeros(CharacteristicMatrix(ClosedLoop(LinearPlant(0.0), TwoOrders(c, k1, k2)).system))
    assert not marginal.any()
    roots = [np.roots([1.0, a, 0.0, b, p]) for a, b, p in zip(k1, k2, c, strict=True)]
    expected = [(np.abs(np.angle(values)) < np.pi / 4.0).sum() for values in roots]
    np.testing.assert_array_equal(zeros, expected)
    assert set(expected) == {0, 2}


def test_blocks_count_as_they_do_alone(members: list[Loop]) -> None:
    """Uncoupled planes of one loop, one of them with a zero close to the origin."""
    some = members[:20]
    orders = [0.9, 0.7]
    planes = [(m.k_p - m.stiffness, m.k_d) for m in some]
    damping = block_diag(some[0].damping, 0.0)
    k_p, k_d = (np.array([block_diag(plane[i], (-1e-7, 1.0)[i]) for plane in planes]) for i in range(2))
    zeros, _ = unstable_zeros(characteristic(LinearPlant(np.zeros((3, 3)), damping), k_p, k_d, [*orders, 0.8]))
    alone = [poles.unstable_count(member.replace(alpha=orders)) for member in some]
    np.testing.assert_array_equal(zeros, np.array(alone) + 1)


def test_gains_that_only_some_entries_have() -> None:
    """A batch of diagonal gains and one coupling for all: the diagonal differs from member to member."""
    k_p, k_d = np.array([4.0, 3.5, 2.0]), np.array([2.0, -0.1, 0.5])
    eye, gyroscopic = np.eye(2), np.array([[0.0, 2.0], [-2.0, 0.0]])
    matrix = characteristic(HCWInPlane(), k_p[:, None, None] * eye, k_d[:, None, None] * eye, [0.9, 0.8])
    zeros, _ = unstable_zeros(matrix)
    alone = [
        loops.in_plane(np.hstack([p * eye, d * eye]), [0.9, 0.8], np.zeros(4)) for p, d in zip(k_p, k_d, strict=True)
    ]
    assert np.array_equal(alone[0].damping, gyroscopic)
    np.testing.assert_array_equal(zeros, [poles.unstable_count(member) for member in alone])


def test_pole_radius_is_the_root_of_the_bound() -> None:
    """|σ|² = k |σ|^α + c for one coordinate, to 2 % from above."""
    generator = np.random.default_rng(4)
    c, alpha = 10.0 ** generator.uniform(-2.0, 4.0, (2, 300)), 0.7
    radius = pole_radius(characteristic(LinearPlant(0.0), c[0], c[1], alpha))
    for bound, p, d in zip(radius, *c, strict=True):
        exact = brentq(lambda r, p=p, d=d: r**2 - d * r**alpha - p, 1e-6, 1e6, rtol=1e-13)
        assert exact < bound < 1.02 * exact


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


def count_at_half_orders(
    stiffness: np.ndarray, damping: np.ndarray, k_p: np.ndarray, k_i: np.ndarray, k_d: np.ndarray
) -> int:
    """Count the zeros with λ = μ = 1/2: with s = √σ, s M is s⁵ - damping s³ + K_D s² + (K_P - stiffness) s + K_I."""
    size = len(k_p)
    blocks = [k_i, k_p - stiffness, k_d, -damping, np.zeros((size, size))]
    companion = np.vstack([np.eye(4 * size, 5 * size, size), -np.hstack(blocks)])
    roots = np.linalg.eigvals(companion)
    return int(((np.abs(np.angle(roots)) < np.pi / 4.0) & (np.abs(roots) > 1e-12)).sum())


@pytest.mark.parametrize("order", [0.02, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("k_d", [0.0, 1e-3, 2.0])
def test_a_negative_integral_gain_has_one_real_pole_however_small(order: float, k_d: float) -> None:
    """σ² + k_D σ^μ + 1.5 + k_I σ^(-λ) with k_I < 0 ≤ k_D: by Descartes' rule one positive zero, near (-k_I/1.5)^(1/λ);
    no others, as Im > 0 on the upper axis."""
    k_i = -(10.0 ** np.linspace(-12.0, 0.0, 25))
    law = PILambdaDMu(np.full(25, 0.5), k_i, np.full(25, k_d), order, 0.9)
    zeros, marginal = unstable_zeros(CharacteristicMatrix(ClosedLoop(HCWOutOfPlane(), law).system))
    assert not marginal.any()
    np.testing.assert_array_equal(zeros, 1.0)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_counts_with_integrals_are_those_of_roots_at_half_orders(size: int) -> None:
    """Gains over ten decades, some without an integral, so that the poles nearest to the origin are below any path."""
    generator = np.random.default_rng(20 + size)
    k_p, k_i, k_d = generator.uniform(-3.0, 3.0, (3, 120, size, size))
    k_p, k_d = k_p + 4.0 * np.eye(size), k_d + 3.0 * np.eye(size)
    k_i *= 10.0 ** generator.uniform(-7.0, 0.0, (120, 1, 1))
    k_i[::7] = 0.0
    damping = np.triu(np.ones((size, size)), 1) - np.tril(np.ones((size, size)), -1)
    stiffness = np.zeros((size, size))
    law = PILambdaDMu(*(gain if size > 1 else gain[:, 0, 0] for gain in (k_p, k_i, k_d)), 0.5, 0.5)
    zeros, marginal = unstable_zeros(CharacteristicMatrix(ClosedLoop(LinearPlant(stiffness, damping), law).system))
    expected = [count_at_half_orders(stiffness, damping, *gains) for gains in zip(k_p, k_i, k_d, strict=True)]
    assert not marginal.any()
    np.testing.assert_array_equal(zeros, expected)
    assert len(set(expected)) > 2


def test_integrals_of_orders_of_their_own_count_as_alone() -> None:
    generator = np.random.default_rng(8)
    k_p, k_i, k_d = generator.uniform(-1.0, 1.0, (3, 40, 2, 2)) * np.array([2.0, 1e-3, 1.0])[:, None, None, None]
    k_p, k_d, k_i[::5] = k_p + 5.0 * np.eye(2), k_d + 3.0 * np.eye(2), 0.0
    integral, derivative = generator.uniform(0.2, 1.0, (2, 40, 2))
    law = PILambdaDMu(k_p, k_i, k_d, integral, derivative)
    zeros, marginal = unstable_zeros(CharacteristicMatrix(ClosedLoop(HCWInPlane(), law).system))
    assert not marginal.any()
    for i in range(40):
        alone = PILambdaDMu(k_p[i], k_i[i], k_d[i], integral[i], derivative[i])
        assert unstable_zeros(CharacteristicMatrix(ClosedLoop(HCWInPlane(), alone).system))[0] == zeros[i]
    assert len(set(zeros)) > 1


@pytest.mark.parametrize("scale", [1e-9, 1.0])
def test_integrals_of_one_combination_count_as_one(scale: float) -> None:
    """K_I of rank one: the lowest power of the determinant vanishes but for rounding."""
    generator = np.random.default_rng(9)
    left, right = generator.normal(size=(2, 50, 2))
    k_i = scale * left[:, :, None] * right[:, None, :]
    k_p, k_d = 5.0 * np.eye(2) + generator.normal(size=(50, 2, 2)), np.broadcast_to(3.0 * np.eye(2), (50, 2, 2))
    law = PILambdaDMu(k_p, k_i, k_d, 0.5, 0.5)
    nothing = np.zeros((2, 2))
    zeros, marginal = unstable_zeros(CharacteristicMatrix(ClosedLoop(LinearPlant(nothing), law).system))
    expected = [count_at_half_orders(nothing, nothing, *gains) for gains in zip(k_p, k_i, k_d, strict=True)]
    assert not marginal.any()
    np.testing.assert_array_equal(zeros, expected)
