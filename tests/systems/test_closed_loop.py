"""The closed loop as an equation in data: Σ A_j D^β_j y = 0 must be the written-out equation of motion."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.controllers import PDAlpha, PDLag
from fracctl.errors import ArgumentError
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.fractional.terms import FractionalTerm, powers
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant
from tests.references import loops, poles


def matrix_at(system: LinearFractionalSystem, sigma: complex, member: int = 0) -> np.ndarray:
    """Return Σ A_j diag(σ^β_j) of one member."""
    total = np.zeros((system.size, system.size), complex)
    for term in system.dynamics:
        matrix = term.matrix if term.matrix.ndim == 2 else term.matrix[member % len(term.matrix)]
        orders = term.orders if term.orders.ndim == 1 else term.orders[member % len(term.orders)]
        total += matrix * np.array([sigma**o for o in orders])
    return total


@pytest.mark.parametrize("sigma", [0.3 + 0.8j, -1.2 + 0.1j, 2.0 + 0j])
def test_in_plane_system_is_the_written_out_equation(sigma: complex) -> None:
    loop = next(loops.random_in_plane(3, 1))
    system = ClosedLoop(HCWInPlane(), PDAlpha(loop.k_p, loop.k_d, loop.alpha)).system
    expected = poles.matrix_entries(loop, sigma, [sigma**a for a in loop.alpha])
    np.testing.assert_allclose(matrix_at(system, sigma), expected, rtol=1e-14)


def test_out_of_plane_members_are_the_written_out_equations() -> None:
    members = list(loops.random_out_of_plane(4, 5))
    k_p, k_d, alpha = ([float(np.ravel(getattr(m, name))[0]) for m in members] for name in ("k_p", "k_d", "alpha"))
    system = ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p, k_d, alpha)).system
    sigma = 0.7 + 1.1j
    for i, member in enumerate(members):
        expected = poles.matrix_entries(member, sigma, [sigma ** member.alpha[0]])
        np.testing.assert_allclose(matrix_at(system, sigma, i), expected, rtol=1e-14)
    taken = system.take(np.array([3, 1]))
    assert taken.batch == 2
    np.testing.assert_allclose(matrix_at(taken, sigma, 1), matrix_at(system, sigma, 1), rtol=1e-15)


def test_auxiliary_states_enter_the_equation() -> None:
    """det M of the lag is (σ² + 1 + k_P)(T σ + 1) + k_D σ, divided by T."""
    loop = ClosedLoop(HCWOutOfPlane(), PDLag(k_p=0.5, k_d=2.0, time_constant=0.3))
    assert (loop.system.n_positions, loop.system.n_auxiliary, loop.system.size) == (1, 1, 2)
    for sigma in (0.4 + 0.9j, -2.0 + 0.1j):
        expected = ((sigma**2 + 1.5) * (0.3 * sigma + 1.0) + 2.0 * sigma) / 0.3
        assert np.linalg.det(matrix_at(loop.system, sigma)) == pytest.approx(expected, rel=1e-13)


def test_initial_values_without_auxiliary_states() -> None:
    loop = ClosedLoop(HCWInPlane(), PDAlpha(np.eye(2), np.eye(2), 0.9))
    value, rate = loop.initial_values(np.array([1.0, 2.0, 3.0, 4.0]))
    np.testing.assert_array_equal(value, [1.0, 2.0])
    np.testing.assert_array_equal(rate, [3.0, 4.0])
    value, rate = loop.initial_values(np.arange(12.0).reshape(3, 4))
    np.testing.assert_array_equal(value, [[0, 1], [4, 5], [8, 9]])
    np.testing.assert_array_equal(rate, [[2, 3], [6, 7], [10, 11]])


def test_initial_values_with_auxiliary_states() -> None:
    loop = ClosedLoop(HCWOutOfPlane(), PDLag(k_p=0.5, k_d=2.0, time_constant=0.3))
    value, rate = loop.initial_values(np.array([1.0, 2.0]))
    np.testing.assert_array_equal(value, [1.0, 0.0])
    np.testing.assert_array_equal(rate, [2.0, 0.0])
    value, _ = loop.initial_values(np.array([[1.0, 2.0, 7.0], [3.0, 4.0, 8.0]]))
    np.testing.assert_array_equal(value, [[1.0, 7.0], [3.0, 8.0]])


@pytest.mark.parametrize("shape", [(3,), (2, 3), (5,), (1, 1, 4), ()])
def test_initial_states_of_wrong_shape_are_refused(shape: tuple[int, ...]) -> None:
    loop = ClosedLoop(HCWInPlane(), PDAlpha(np.eye(2), np.eye(2), 0.9))
    with pytest.raises(ArgumentError, match=r"`initial_state` must have shape \(4,\) or \(b, 4\)"):
        loop.initial_values(np.zeros(shape))


def test_a_loop_refuses_at_once() -> None:
    with pytest.raises(ArgumentError, match=r"`k_p` must have shape \(2, 2\)"):
        ClosedLoop(LinearPlant(np.eye(2)), PDAlpha(1.0, 1.0))


def test_terms_refuse_orders_outside_their_range() -> None:
    with pytest.raises(ArgumentError, match=r"`orders` must lie in \[-1, 2\], but is 2.5"):
        FractionalTerm(np.eye(1), np.array([2.5]))
    with pytest.raises(ArgumentError, match="one order for each of the 2 columns"):
        FractionalTerm(np.eye(2), np.array([1.0]))


def test_powers_lie_on_the_principal_sheet() -> None:
    sigma = np.array([1j, -1.0 + 1e-12j, 2.0 - 1.0j])
    values = powers(sigma, np.array([0.5, 0.0, 2.0, -1.0]))
    np.testing.assert_allclose(values[0], np.sqrt(sigma), rtol=1e-14)
    np.testing.assert_array_equal(values[1], np.ones(3))
    np.testing.assert_array_equal(values[2], sigma**2)
    np.testing.assert_array_equal(values[3], sigma**-1.0)
