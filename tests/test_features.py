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
    crossing = last_crossing(grid, values, grid.slope(values), level)[0]
    assert crossing == pytest.approx(centre + width, abs=1e-10)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_largest_excursion_is_exact_between_nodes(side: float) -> None:
    values = (side * np.exp(-0.2 * GRID.times) * np.sin(1.3 * GRID.times))[None]
    top = np.arctan2(1.3, 0.2) / 1.3
    second = top + np.pi / 1.3
    heights = [np.exp(-0.2 * t) * abs(np.sin(1.3 * t)) for t in (top, second)]
    slopes = GRID.slope(values)
    for chosen, height in ((side, heights[0]), (-side, heights[1]), (0.0, heights[0])):
        found = largest_excursion(GRID, values, slopes, np.array([chosen]), with_end=False)
        assert found[0] == pytest.approx(height, rel=1e-10)


def test_the_last_crossing_is_exact_between_nodes() -> None:
    values = np.exp(-GRID.times)[None]
    slopes = GRID.slope(values)
    assert last_crossing(GRID, values, slopes, 0.05)[0] == pytest.approx(np.log(20.0), abs=1e-10)
    assert last_crossing(GRID, values, slopes, 1e-4)[0] == np.inf
    assert last_crossing(GRID, values, slopes, 2.0)[0] == 0.0


def test_changes_of_sign_are_located_in_the_integral() -> None:
    values = np.sin(GRID.times)[None]
    assert absolute_integral(GRID, values)[0] == pytest.approx(5.0 - np.cos(7.0), rel=1e-10)
