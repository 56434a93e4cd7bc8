"""SVG files as elements of a page."""

from __future__ import annotations

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from fracctl.figures.style import render, style
from fracctl.report.pictures import inline


def drawn(points: int = 50, marker: str = "") -> bytes:
    with style():
        figure = Figure(figsize=(4.0, 3.0), layout="constrained")
        axes = figure.subplots()
        x = np.linspace(0.0, 1.0, points)
        axes.plot(x, np.sin(40.0 * x), marker=marker, label=r"$\alpha_w$")
        axes.fill_between(x[:50], 0.0, 1.0, hatch="///")
        axes.set_xlim(0.2, 0.8)
        axes.legend()
        return render(figure, ["svg"])["svg"]


def names(text: str) -> set[str]:
    return set(re.findall(r'\bid="([^"]+)"', text))


def test_a_file_is_the_same_on_repeat_and_bears_no_date() -> None:
    first = drawn()
    assert first == drawn()
    assert b"<dc:date" not in first
    assert b"matplotlib.org" not in first.lower()


def test_two_pictures_of_a_page_share_no_name_and_find_their_own() -> None:
    first, second = inline(drawn(), "a"), inline(drawn(), "b")
    assert names(first)
    assert not names(first) & names(second)
    used = {*re.findall(r'href="#([^"]+)"', first), *re.findall(r"url\(#([^)]+)\)", first)}
    assert used == names(first)
    assert all(name.startswith("a-") for name in used)
    assert second == inline(drawn(), "a").replace('"a-', '"b-').replace("#a-", "#b-")


def test_a_picture_says_nothing_to_the_rest_of_the_page_and_is_smaller() -> None:
    source = drawn()
    picture = inline(source, "a")
    for word in ("<?xml", "<!DOCTYPE", "<style", "<metadata", "<!--"):
        assert word not in picture
    assert 'stroke-linejoin="round"' in picture
    assert len(picture) < 0.9 * len(source)
    assert re.search(r'viewBox="0 0 288 216"', picture)


def test_places_are_rounded_to_what_a_screen_shows() -> None:
    picture = inline(drawn(), "a")
    paths = re.findall(r' d="([^"]+)"', picture)
    assert paths
    assert not any(re.search(r"\d\.\d{3,}", path) for path in paths)
    scales = re.findall(r"scale\(([^)]+)\)", drawn().decode())
    assert scales
    assert re.findall(r"scale\(([^)]+)\)", picture) == scales, "a rounded factor would move letters"


@pytest.mark.parametrize(("points", "images"), [(100, 0), (20_000, 1)])
def test_what_is_dense_becomes_an_image(points: int, images: int) -> None:
    picture = inline(drawn(points, "o"), "a")
    assert picture.count("<image") == images
    assert picture.count('href="data:image/png;base64,') == images
    assert len(picture) < 150_000
