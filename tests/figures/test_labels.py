"""Symbols, words and units on the figures."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.mathtext import MathTextParser

from fracctl.figures import labels


@pytest.mark.parametrize(
    ("column", "symbol"),
    [
        ("alpha_w", r"\alpha_{w}"),
        ("k_p_uv", "k_{P_{uv}}"),
        ("k_d_w", "k_{D_{w}}"),
        ("k_d_alpha_uv", r"k_{D^\alpha_{uv}}"),
        ("k_i_w", "k_{I_{w}}"),
        ("lambda_u", r"\lambda_{u}"),
        ("time_constant_w", "T_{f_{w}}"),
        ("w", "w"),
        ("w_dot", "w'"),
        ("control_u", r"\upsilon_{u}"),
        ("settling_time", r"\mathrm{ST}"),
        ("largest_multiplier", r"\mathrm{largest\ multiplier}"),
    ],
)
def test_symbols(column: str, symbol: str) -> None:
    assert labels.symbol(column) == symbol
    MathTextParser("path").parse(f"${symbol}$")


def test_objectives() -> None:
    assert labels.objective(["settling_time"]) == r"Settling time $\mathrm{ST}$"
    assert labels.objective(["delta_v"]) == "Delta v"
    combined = labels.objective(["settling_time", "overshoot", "control_effort"])
    assert combined == r"$(\mathrm{ST}\cdot \mathrm{OS}\cdot U)^{1/3}$"
    MathTextParser("path").parse(combined)


@pytest.mark.parametrize(("name", "words"), [("ic1", "IC1"), ("own", "own"), ("far_away", "far away")])
def test_initial_conditions(name: str, words: str) -> None:
    assert labels.initial_condition(name) == words


def test_controllers_name_their_law_and_few_gains() -> None:
    fractional = {"alpha_w": 0.91, "k_p_w": 0.85, "k_d_w": 2.0}
    assert labels.controller(fractional) == (r"PD$^{\alpha}$: $\alpha_{w} = 0.91$, $k_{P_{w}} = 0.85$, $k_{D_{w}} = 2$")
    assert labels.controller(fractional | {"alpha_w": 1.0}).startswith("PD: ")
    lag = {"time_constant_w": 0.3, "k_p_w": 0.5, "k_d_w": 2.0}
    assert labels.controller(lag) == "PD with lag: $T_{f_{w}} = 0.3$, $k_{P_{w}} = 0.5$, $k_{D_{w}} = 2$"
    assert labels.controller(lag | {"k_i_w": 0.1}) == "PID: $T_{f_{w}} = 0.3$"
    many = {"alpha_u": 1.0, "alpha_v": 1.0} | {
        f"k_{term}_{name}": 1.0 for term in "pd" for name in ("u", "uv", "vu", "v")
    }
    assert labels.controller(many) == r"PD: $\alpha_{u} = 1$, $\alpha_{v} = 1$"


@pytest.mark.parametrize(
    ("value", "text"), [(1e-5, "10^{-5}"), (2.5e-4, r"2.5\times 10^{-4}"), (0.01, "0.01"), (3.0, "3")]
)
def test_numbers(value: float, text: str) -> None:
    assert labels.number(value) == text


@pytest.mark.parametrize(("metres", "unit"), [(2e4, "km"), (100.0, "m"), (0.02, "mm"), (0.0, "mm")])
def test_length_units(metres: float, unit: str) -> None:
    assert labels.length_unit(metres)[1] == unit


@given(st.floats(1e-300, 1e300))
def test_axes_have_handy_numbers(largest: float) -> None:
    factor, note = labels.power_of_ten(largest)
    assert 0.1 <= largest / factor < 1e3 * (1 + 1e-9)
    assert (note == "") == (factor == 1.0)


def test_nothing_to_show_is_not_scaled() -> None:
    assert labels.power_of_ten(0.0) == labels.power_of_ten(math.inf) == (1.0, "")
