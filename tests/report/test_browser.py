"""The report in a real browser: quiet, whole without a network, sortable, and as wide as its reader's screen."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from fracctl.config.compose import compose
from fracctl.execution.run import execute
from fracctl.report.page import _render, comparison_page, run_page, write
from fracctl.report.stored import StoredRun
from fracctl.report.tables import Cell, Table, of_records

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
QUIET = [
    *("--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
]
GRID = [
    "survey.axes.alpha_w=[0.91,1.0]",
    "survey.axes.k_p_w=[0.55,0.85]",
    "survey.axes.k_d_w=[1.8,1.9,2.0]",
    "scheduler=serial",
]
WIDTHS = (1280, 390)

EMPTY: dict[str, Any] = {
    **dict.fromkeys(("runs", "alerts", "notes", "results", "commands", "provenance"), ()),
    "title": "none",
    "overview": Table("The runs", (), ()),
    "differences": Table("", (), ()),
    "figures": {},
}

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (apt-get install chromium)")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A report on a run with a failure told first, and one on two runs."""
    folder = tmp_path_factory.mktemp("reports")
    runs = [
        StoredRun.read(execute(compose([f"experiment={name}", *GRID, f"output_dir={folder}"])).run_directory)
        for name in ("ic1_outofplane", "ic2_outofplane")
    ]
    paths = {"run": folder / "run.html", "comparison": folder / "comparison.html"}
    write(paths["run"], run_page(runs[0]))
    write(paths["comparison"], comparison_page(runs))
    return paths


class Watched:
    """A page of the browser, and all that it said and asked for."""

    def __init__(self, browser: Browser, path: Path, width: int, scheme: str = "light") -> None:
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page: Page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)  # type: ignore[arg-type]
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(path.as_uri())

    def column(self, caption: str, place: int) -> list[str]:
        """Texts of a column of the first table whose caption begins so."""
        cells = self.page.locator("table", has_text=caption).first.locator(f"tbody tr td:nth-child({place})")
        return cells.all_inner_texts()


@pytest.mark.parametrize("name", ["run", "comparison"])
@pytest.mark.parametrize("width", WIDTHS)
def test_a_report_is_quiet_whole_and_as_wide_as_the_screen(
    browser: Browser, pages: dict[str, Path], name: str, width: int
) -> None:
    watched = Watched(browser, pages[name], width)
    assert watched.said == []
    assert [url for url in watched.asked if not url.startswith("data:")] == [pages[name].as_uri()]
    wide, screen = watched.page.evaluate("[document.documentElement.scrollWidth, document.documentElement.clientWidth]")
    assert wide <= screen == width
    assert watched.page.evaluate("[...document.querySelectorAll('svg')].every(svg => svg.getBBox().width > 100)")
    assert watched.page.evaluate("document.querySelectorAll('svg').length") > 0
    watched.page.close()


def test_a_wide_table_scrolls_within_itself(browser: Browser, pages: dict[str, Path]) -> None:
    watched = Watched(browser, pages["run"], 390)
    scrolled = watched.page.evaluate(
        "(() => {const box = [...document.querySelectorAll('.scroll')].find(box => box.scrollWidth > box.clientWidth);"
        "box.scrollLeft = 100; return box.scrollLeft;})()"
    )
    assert scrolled == 100
    watched.page.close()


def test_a_click_on_a_heading_sorts_and_another_turns_it(browser: Browser, pages: dict[str, Path]) -> None:
    watched = Watched(browser, pages["run"], 1280)
    table = watched.page.locator("table", has_text="Evaluated points").first
    headings = table.locator("th").all_inner_texts()
    place = headings.index("k_d_w") + 1
    button = table.locator("th", has_text="k_d_w").locator("button")
    before = watched.column("Evaluated points", place)
    button.click()
    ascending = watched.column("Evaluated points", place)
    button.click()
    descending = watched.column("Evaluated points", place)
    assert ascending == sorted(before, key=float) != before
    assert descending == sorted(before, key=float, reverse=True)
    assert table.locator("th[aria-sort]").all_inner_texts() == ["k_d_w"]
    assert watched.said == []
    watched.page.close()


def test_numbers_sort_as_numbers_and_never_is_the_last_before_words(browser: Browser, tmp_path: Path) -> None:
    values = [10.0, math.inf, 9.0, None, 1e-3, 2.0]
    table = of_records("Times", [{"settling_orbits": value, "sign": "+"} for value in values], "times.csv")
    rows = [[*row[:1], Cell("> 3", 3.0)] for row in table.rows]
    page = tmp_path / "page.html"
    write(page, _render("comparison.html", **EMPTY | {"results": [replace(table, rows=rows)]}))
    watched = Watched(browser, page, 1280)
    watched.page.locator("table", has_text="Times").locator("th button").first.click()
    assert watched.column("Times", 1) == ["0.001", "2", "9", "10", "never", "never"]
    assert watched.said == []
    watched.page.close()


def test_without_script_all_is_there(browser: Browser, pages: dict[str, Path]) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(pages["run"].as_uri())
    assert page.locator("th button").count() == 0
    assert page.locator("tbody tr").count() > 10
    context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_from_its_ground(browser: Browser, pages: dict[str, Path], scheme: str) -> None:
    """A contrast of 4.5 : 1 at least (WCAG 2.1, 1.4.3), for every element with text of its own."""
    watched = Watched(browser, pages["run"], 1280, scheme)
    ground, worst = watched.page.evaluate(_CONTRAST)
    assert (ground > 0.9) == (scheme == "light")
    assert worst["contrast"] >= 4.5, worst
    watched.page.close()


_CONTRAST = """(() => {
  const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const linear = (c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  const light = (colour) => colour.slice(0, 3).map((c) => linear(c / 255))
    .reduce((sum, c, place) => sum + c * [0.2126, 0.7152, 0.0722][place], 0);
  const ground = (element) => {
    for (let own = element; own; own = own.parentElement) {
      const colour = numbers(getComputedStyle(own).backgroundColor);
      if (colour.length < 4 || colour[3] > 0) return light(colour);
    }
    return 1;
  };
  const found = [...document.querySelectorAll("body *:not(svg *):not(script)")]
    .filter((element) => [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()))
    .map((element) => {
      const pair = [light(numbers(getComputedStyle(element).color)), ground(element)];
      const contrast = (Math.max(...pair) + 0.05) / (Math.min(...pair) + 0.05);
      return {contrast, text: element.textContent.slice(0, 40), tag: element.tagName};
    });
  return [ground(document.body), found.reduce((one, other) => one.contrast < other.contrast ? one : other)];
})()"""
