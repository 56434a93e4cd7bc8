"""Axes as strings, numbers and lists."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fracctl.errors import ArgumentError
from fracctl.surveys import axis_values


def test_both_ends_are_included_and_values_are_exact_decimals() -> None:
    values = axis_values("0.80:1.00:0.01")
    assert values.tolist() == [float(f"0.{n}") for n in range(80, 100)] + [1.0]
    assert 0.94 in values


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        ("0:2:0.5", [0.0, 0.5, 1.0, 1.5, 2.0]),
        ("1:0:-0.25", [1.0, 0.75, 0.5, 0.25, 0.0]),
        ("0.005:0.025:0.01", [0.005, 0.015, 0.025]),
        (" -1 : 1 : 1e0 ", [-1.0, 0.0, 1.0]),
        ("0.3:0.3:0.1", [0.3]),
        ("0:1:0.333333333333", [0.0, 0.333333333333, 0.666666666666, 1.0]),
        ("0.91", [0.91]),
        (0.91, [0.91]),
        (1, [1.0]),
        ([0.91, 1], [0.91, 1.0]),
    ],
)
def test_forms(spec: str | float | list[float], expected: list[float]) -> None:
    assert axis_values(spec).tolist() == expected


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("0:1:0", "step other than 0"),
        ("0:1:-0.1", "leads from start to stop"),
        ("0:1:0.3", "the last value is 0.9 or 1.2"),
        ("0:1", "start:stop:step"),
        ("a:b:c", "start:stop:step"),
        ("0:inf:1", "start:stop:step"),
        ("0:nan:1", "start:stop:step"),
        ("", "start:stop:step"),
        ("0:1:1e-9", "at most"),
        ([], "at least one value"),
        ([0.9, float("nan")], "finite"),
        ([0.9, 0.9], "repeat"),
        (True, "a number"),
        (["0.9"], "a list of numbers"),
    ],
)
def test_what_is_no_axis_is_refused_in_a_sentence(spec: str, words: str) -> None:
    with pytest.raises(ArgumentError, match=words):
        axis_values(spec, "alpha_w")


def test_the_message_names_the_axis() -> None:
    with pytest.raises(ArgumentError, match="`alpha_w`"):
        axis_values("0:1:0", "alpha_w")


@given(start=st.integers(-500, 500), count=st.integers(0, 300), step=st.integers(1, 50), decimals=st.integers(0, 4))
def test_every_value_is_the_nearest_float_of_its_decimal(start: int, count: int, step: int, decimals: int) -> None:
    def text(integer: int) -> str:
        return f"{integer}e-{decimals}"

    values = axis_values(f"{text(start)}:{text(start + count * step)}:{text(step)}")
    assert values.tolist() == [float(text(start + i * step)) for i in range(count + 1)]
    assert np.unique(values).size == count + 1
