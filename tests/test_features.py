"""Crossings, extrema and absolute integrals of known functions, with features that lie between two nodes."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.features import absolute_integral, largest_excursion, last_crossing
from fracctl.panels import Panel, PanelGrid

GRID = PanelGrid([Panel(1e-9, 0.1, 24, logarithmic=True), Panel(0.1, 1.0, 24), Panel(1.0, 7.0, 24)])
LEFT = int(np.flatnonzero(GRID.times > 3.5)[0])
A, B = GRID.times[LEFT], GRID.times[LEFT + 1]


def parabola(depth: float, place: float) -> np.ndarray:
    """(t - c)² - d² with both roots c ± d between the nodes A and B."""
    centre = A + place * (B - A)
    return ((GRID.times - centre) ** 2 - depth**2)[None]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("place", [0.3, 0.5, 0.7])
def test_a_dip_between_two_nodes_is_integrated(place: float, sign: float) -> None:
    depth = 0.2 * (B - A)
    values = sign * parabola(depth, place)
    assert (values > 0.0).all() or (values < 0.0).all()
    centre = A + place * (B - A)
    signed = ((7.0 - centre) ** 3 + centre**3) / 3.0 - 7.0 * depth**2
    exact = signed + 2.0 * (4.0 / 3.0) * depth**3
    assert absolute_integral(GRID, values)[0] == pytest.approx(exact, rel=1e-8, abs=0.0)
    assert signed < exact * (1.0 - 1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_hump_between_two_nodes_is_the_last_crossing(sign: float) -> None:
    grid = PanelGrid([Panel(3.0, 4.0, 24)])
    left, right = grid.times[11:13]
    centre, width, level = left + 0.4 * (right - left), 0.1 * (right - left), 1.0
    values = sign * (level * np.cos(5.0 * (grid.times - centre)) / np.cos(5.0 * width))[None]
    assert (np.abs(values) < level).all()
    crossing = last_crossing(grid, values, level)[0]
    assert crossing == pytest.approx(centre + width, abs=1e-10)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_largest_excursion_is_exact_between_nodes(side: float) -> None:
    values = (side * np.exp(-0.2 * GRID.times) * np.sin(1.3 * GRID.times))[None]
    top = np.arctan2(1.3, 0.2) / 1.3
    second = top + np.pi / 1.3
    heights = [np.exp(-0.2 * t) * abs(np.sin(1.3 * t)) for t in (top, second)]
    for chosen, height in ((side, heights[0]), (-side, heights[1]), (0.0, heights[0])):
        found = largest_excursion(GRID, values, np.array([chosen]), with_end=False)
        assert found[0] == pytest.approx(height, rel=1e-10)


def test_the_last_crossing_is_exact_between_nodes() -> None:
    values = np.exp(-GRID.times)[None]
    assert last_crossing(GRID, values, 0.05)[0] == pytest.approx(np.log(20.0), abs=1e-10)
    assert last_crossing(GRID, values, 1e-4)[0] == np.inf
    assert last_crossing(GRID, values, 2.0)[0] == 0.0


def test_changes_of_sign_are_located_in_the_integral() -> None:
    values = np.sin(GRID.times)[None]
    assert absolute_integral(GRID, values)[0] == pytest.approx(5.0 - np.cos(7.0), rel=1e-10)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("shift", [-1e-2, -1e-4, -1e-9, 0.0, 1e-9, 1e-4, 1e-2])
def test_an_extremum_next_to_the_end_of_a_panel(shift: float, sign: float) -> None:
    """cos(t - 1 - shift), with a maximum next to the boundary at 1, a minimum at 4.1 and changes of sign between."""
    values = sign * np.cos(GRID.times - 1.0 - shift)[None]
    for side in (sign, -sign):
        assert largest_excursion(GRID, values, np.array([side]), with_end=False)[0] == pytest.approx(1.0, abs=1e-10)
    exact = np.sin(1.0 + shift) + 4.0 + np.sin(6.0 - shift) + 1.0 - 1.0
    assert absolute_integral(GRID, values)[0] == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("node", [LEFT, 24, 47, 48, 71])
def test_features_at_a_node(node: int) -> None:
    """A maximum, a double zero, a change of sign and a crossing exactly at a node, the ends of panels among them."""
    time = GRID.times[node]
    hill = 1.0 - ((GRID.times - time)[None] / 7.0) ** 2
    assert largest_excursion(GRID, hill, np.ones(1), with_end=time == 7.0)[0] == pytest.approx(1.0, abs=1e-12)
    assert absolute_integral(GRID, 1.0 - hill)[0] == pytest.approx((time**3 + (7.0 - time) ** 3) / 147.0, rel=1e-8)
    line = (GRID.times - time)[None]
    assert absolute_integral(GRID, line)[0] == pytest.approx(0.5 * (time**2 + (7.0 - time) ** 2), rel=1e-8)
    assert last_crossing(GRID, 8.0 - GRID.times[None], 8.0 - time)[0] == pytest.approx(time, abs=1e-12)


def test_a_maximum_hidden_on_the_way_down_is_found() -> None:
    """t³/3 - ε² t falls at every node, yet rises by 4ε³/3 between two extrema less than two nodes apart."""
    grid = PanelGrid([Panel(0.0, 1.0, 40), Panel(1.0, 7.0, 40)])
    node = int(np.flatnonzero(grid.times > 4.0)[0])
    gap, centre = grid.times[node + 1] - grid.times[node], grid.times[node]
    for epsilon in (0.3 * gap, 0.1 * gap):
        values = -(((grid.times - centre) ** 3) / 3.0 - epsilon**2 * (grid.times - centre))[None]
        assert (np.diff(values[0]) <= 0.0).all()
        found = largest_excursion(grid, values + 1.0, np.array([1.0]), with_end=False)[0]
        assert found == pytest.approx(1.0 + 2.0 * epsilon**3 / 3.0, abs=1e-10)


def test_flat_rounding_is_no_maximum() -> None:
    values = (1.0 - 0.1 * GRID.times**2 / (1.0 + GRID.times**2))[None]
    noise = np.random.default_rng(3).uniform(-1e-13, 1e-13, values.shape)
    assert largest_excursion(GRID, values + noise, np.array([0.0]), with_end=False)[0] == 0.0
    assert largest_excursion(GRID, np.ones_like(values), np.array([0.0]), with_end=False)[0] == 0.0


def test_start_and_end_on_the_band() -> None:
    falls = np.exp(-GRID.times)[None]
    assert last_crossing(GRID, falls, falls[0, 0])[0] == 0.0
    assert last_crossing(GRID, falls, falls[0, -1])[0] == pytest.approx(7.0, abs=1e-12)
    assert last_crossing(GRID, np.ones_like(falls), 1.0)[0] == 0.0
    assert absolute_integral(GRID, np.zeros_like(falls))[0] == 0.0


def test_members_do_not_see_each_other() -> None:
    phases = np.linspace(0.0, 6.0, 30)
    values = np.exp(-0.5 * GRID.times) * np.sin(3.0 * GRID.times + phases[:, None])
    side = np.zeros(30)
    whole = (
        last_crossing(GRID, values, 0.05),
        largest_excursion(GRID, values, side, with_end=False),
        absolute_integral(GRID, values),
    )
    part = slice(7, 12)
    for all_members, some in zip(
        whole,
        (
            last_crossing(GRID, values[part], 0.05),
            largest_excursion(GRID, values[part], side[part], with_end=False),
            absolute_integral(GRID, values[part]),
        ),
        strict=True,
    ):
        np.testing.assert_array_equal(all_members[part], some)


def test_missing_values_are_infinite() -> None:
    values = np.full((1, len(GRID.times)), np.nan)
    for measured in (
        last_crossing(GRID, values, 0.1),
        largest_excursion(GRID, values, np.zeros(1), with_end=True),
        absolute_integral(GRID, values),
    ):
        assert measured[0] == np.inf


@pytest.mark.parametrize("turned", [False, True])
def test_a_dip_next_to_a_change_of_sign_is_integrated(turned: bool) -> None:
    """Three zeros in two intervals, of which the nodes show one: r, and a pair behind the next node."""
    gap = B - A
    zeros = np.array([A - 0.3 * gap, A + 0.4 * gap, A + 0.7 * gap])
    if turned:
        zeros = A + B - zeros[::-1]
    cubic = np.polynomial.Polynomial.fromroots(zeros)
    values = cubic(GRID.times)[None]
    assert np.count_nonzero(np.diff(np.sign(values[0, 48:]))) == 1
    integral = cubic.integ()
    exact = np.abs(np.diff(integral(np.concatenate([[0.0], zeros, [7.0]])))).sum()
    computed = absolute_integral(GRID, values)[0]
    shown = np.abs(np.diff(integral(np.array([0.0, zeros[2 if turned else 0], 7.0])))).sum()
    assert abs(computed - exact) < 1e-3 * (exact - shown)
