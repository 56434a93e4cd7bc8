"""PD^α as a law: names and ranges of its parameters, shapes of its gains, and the terms it contributes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fracctl.controllers import Parameter, PDAlpha
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop
from fracctl.plants import HCW, HCWInPlane, HCWOutOfPlane

IN_PLANE_NAMES = [
    *("alpha_u", "alpha_v"),
    *("k_p_u", "k_p_uv", "k_p_vu", "k_p_v"),
    *("k_d_u", "k_d_uv", "k_d_vu", "k_d_v"),
]


@pytest.mark.parametrize("alpha", [1e-9, 0.5, 1.0, [0.3, 1.0]])
def test_orders_up_to_one_are_accepted(alpha: float | list[float]) -> None:
    PDAlpha(k_p=np.eye(2), k_d=np.eye(2), alpha=alpha)


@pytest.mark.parametrize("alpha", [0.0, -0.1, 1.3, [0.5, 1.0000001], [0.0, 1.0]])
def test_orders_outside_the_range_are_refused(alpha: float | list[float]) -> None:
    with pytest.raises(ArgumentError, match=r"^Argument `alpha` must lie in \(0, 1\], but is "):
        PDAlpha(k_p=np.eye(2), k_d=np.eye(2), alpha=alpha)


@pytest.mark.parametrize("name", ["k_p", "k_d", "alpha"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_refused(name: str, value: float) -> None:
    arguments = {"k_p": 1.0, "k_d": 1.0, "alpha": 0.9} | {name: value}
    with pytest.raises(ArgumentError, match=f"`{name}` must hold finite numbers only"):
        PDAlpha(**arguments)


@pytest.mark.parametrize(
    ("law", "batch"),
    [
        (PDAlpha(0.85, 2.0, 0.91), None),
        (PDAlpha([0.85, 1.0, 1.2], 2.0, 0.91), 3),
        (PDAlpha(0.85, [2.0, 1.0], [0.91, 0.95]), 2),
        (PDAlpha([0.85, 1.0], [2.0, 1.0], 0.91), 2),
        (PDAlpha([[0.85]], [[2.0]], [0.91]), None),
        (PDAlpha(np.ones((4, 1, 1)), 2.0, np.full(4, 0.9)), 4),
        (PDAlpha([1.0], [2.0], [0.9]), 1),
    ],
)
def test_shapes_for_one_control(law: PDAlpha, batch: int | None) -> None:
    assert ClosedLoop(HCWOutOfPlane(), law).batch == batch


@pytest.mark.parametrize(
    ("law", "batch"),
    [
        (PDAlpha(np.eye(2), np.eye(2)), None),
        (PDAlpha(np.eye(2), np.eye(2), [0.9, 0.8]), None),
        (PDAlpha(np.ones((5, 2, 2)), np.eye(2), 0.9), 5),
        (PDAlpha(np.ones((5, 2, 2)), np.ones((5, 2, 2)), np.full((5, 2), 0.9)), 5),
        (PDAlpha(np.eye(2), np.eye(2), np.full((5, 2), 0.9)), 5),
    ],
)
def test_shapes_for_two_controls(law: PDAlpha, batch: int | None) -> None:
    assert ClosedLoop(HCWInPlane(), law).batch == batch


@pytest.mark.parametrize(
    ("plant", "arguments", "sentence"),
    [
        (
            HCWOutOfPlane(),
            {"k_p": np.ones((2, 2)), "k_d": 1.0},
            r"`k_p` must have shape \(\) or \(b,\) for one control",
        ),
        (
            HCWOutOfPlane(),
            {"k_p": 1.0, "k_d": np.ones((3, 2))},
            r"`k_d` must have shape \(\) or \(b,\) for one control",
        ),
        (
            HCWOutOfPlane(),
            {"k_p": 1.0, "k_d": 1.0, "alpha": np.ones((3, 2))},
            r"`alpha` must have shape \(\), \(1,\) or",
        ),
        (HCWInPlane(), {"k_p": 1.0, "k_d": np.eye(2)}, r"`k_p` must have shape \(2, 2\) or \(b, 2, 2\) for 2 controls"),
        (HCWInPlane(), {"k_p": np.eye(2), "k_d": [1.0, 2.0]}, r"`k_d` must have shape \(2, 2\) or \(b, 2, 2\)"),
        (HCWInPlane(), {"k_p": np.eye(3), "k_d": np.eye(2)}, r"`k_p` must have shape \(2, 2\) or \(b, 2, 2\)"),
        (
            HCWInPlane(),
            {"k_p": np.eye(2), "k_d": np.eye(2), "alpha": [0.9, 0.9, 0.9]},
            r"`alpha` must have shape \(\), \(2,\) or \(b, 2\) for 2 controls, but is of shape \(3,\)",
        ),
    ],
)
def test_wrong_shapes_get_the_allowed_ones(plant: HCW, arguments: dict, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        ClosedLoop(plant, PDAlpha(**arguments))


def test_batches_of_different_sizes_are_refused() -> None:
    with pytest.raises(ArgumentError, match="must have the same batch size as"):
        ClosedLoop(HCWOutOfPlane(), PDAlpha(k_p=[1.0, 2.0], k_d=[1.0, 2.0, 3.0]))


def test_parameter_names_in_table_order() -> None:
    assert [p.name for p in PDAlpha.parameters(("w",))] == ["alpha_w", "k_p_w", "k_d_w"]
    assert [p.name for p in PDAlpha.parameters(("u", "v"))] == IN_PLANE_NAMES
    names = [p.name for p in PDAlpha.parameters(("u", "v", "w"))]
    assert names[:3] == ["alpha_u", "alpha_v", "alpha_w"]
    assert names[3:12] == [f"k_p_{n}" for n in ("u", "uv", "uw", "vu", "v", "vw", "wu", "wv", "w")]
    assert [p.name for p in PDAlpha.parameters(("x1", "x2"))][3] == "k_p_x1_x2"


def test_parameter_defaults_and_ranges() -> None:
    alpha, k_p, k_d = PDAlpha.parameters(("w",))
    assert (alpha.default, k_p.default, k_d.default) == (1.0, 0.0, 0.0)
    assert alpha.allowed == "must lie in (0, 1]"
    assert k_p.allowed == "must be a finite number"
    assert alpha.contains(1.0)
    assert alpha.contains(1e-12)
    assert not any(alpha.contains(x) for x in (0.0, 1.1, np.nan, -np.inf))
    assert k_d.contains(-1e300)
    assert not k_d.contains(np.inf)


def test_parameter_ranges_in_words() -> None:
    assert Parameter("x", lower=0.0).allowed == "must lie in [0, inf)"
    assert Parameter("x", lower=-1.0, upper=2.0).allowed == "must lie in [-1, 2]"
    assert Parameter("x", upper=2.0).allowed == "must lie in (-inf, 2]"


def control_matrices(law: PDAlpha, m: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    proportional, derivative = law.linear_terms(m).control
    assert not proportional.orders.any()
    return proportional.matrix, derivative.matrix, derivative.orders


@given(st.lists(st.floats(-8, 8), min_size=8, max_size=8), st.lists(st.floats(0.01, 1), min_size=2, max_size=2))
def test_parameters_land_where_their_names_say(gains: list[float], alpha: list[float]) -> None:
    """k_p_uv multiplies v in the control of u, and so on (Eq. 7); the law subtracts."""
    values = dict(zip(IN_PLANE_NAMES, [*alpha, *gains], strict=True))
    proportional, derivative, orders = control_matrices(PDAlpha.from_parameters(("u", "v"), values), 2)
    np.testing.assert_array_equal(proportional, -np.reshape(gains[:4], (2, 2)))
    np.testing.assert_array_equal(derivative, -np.reshape(gains[4:], (2, 2)))
    np.testing.assert_array_equal(orders, alpha)


def test_missing_parameters_take_their_defaults() -> None:
    proportional, derivative, orders = control_matrices(PDAlpha.from_parameters(("w",), {"k_d_w": 2.0}), 1)
    assert (float(proportional[0, 0]), float(derivative[0, 0]), float(orders[0])) == (0.0, -2.0, 1.0)


def test_batched_parameters_become_batched_laws() -> None:
    law = PDAlpha.from_parameters(("w",), {"alpha_w": [0.9, 1.0], "k_p_w": 0.5, "k_d_w": [1.0, 2.0]})
    proportional, derivative, orders = control_matrices(law, 1)
    np.testing.assert_array_equal(derivative, [[[-1.0]], [[-2.0]]])
    np.testing.assert_array_equal(orders, [[0.9], [1.0]])
    assert ClosedLoop(HCWOutOfPlane(), law).batch == 2
    law = PDAlpha.from_parameters(("u", "v"), {"alpha_v": [0.9, 0.8, 0.7], "k_p_uv": [1.0, 2.0, 3.0], "k_d_u": 4.0})
    proportional, derivative, orders = control_matrices(law, 2)
    np.testing.assert_array_equal(proportional[:, 0, 1], [-1.0, -2.0, -3.0])
    np.testing.assert_array_equal(orders, [[1.0, 0.9], [1.0, 0.8], [1.0, 0.7]])
    assert ClosedLoop(HCWInPlane(), law).batch == 3


def test_a_single_member_batch_stays_a_batch() -> None:
    law = PDAlpha.from_parameters(("w",), {"alpha_w": [0.9], "k_p_w": [0.5], "k_d_w": [1.0]})
    assert ClosedLoop(HCWOutOfPlane(), law).batch == 1
