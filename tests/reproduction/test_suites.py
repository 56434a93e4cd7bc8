"""Suites: every published row of the repository has a recipe that can be computed, and mistakes are named."""

from __future__ import annotations

import re
from decimal import Decimal
from pathlib import Path

import pandas as pd
import pytest

from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.errors import ConfigurationError
from fracctl.reproduction.recipes import Point, Recipe, RunOptima
from fracctl.reproduction.suites import read_suite, suite_names, suites_directory
from fracctl.surveys.optima import KINDS

PAPERS = suite_names()
SECTIONS = [(paper, section) for paper in PAPERS for section in read_suite(paper).sections]

SUITE = """\
paper: "A. Nonymous: On numbers"
sections:
  one:
    title: "Numbers"
    experiment: outofplane
    sampling: []
    points:
      best: {initial_condition: ic1, objective: settling_time, kind: overall}
    rows:
      a: {column: alpha_w, at: best}
"""
PUBLISHED = "id,place,quantity,unit,published,tolerance,expected,reason\na,p,q,1,2.0,0.1,reproduced,\n"


def folder(directory: Path, suite: str = SUITE, published: str = PUBLISHED) -> Path:
    (directory / "paper").mkdir(exist_ok=True)
    (directory / "paper" / "suite.yaml").write_text(suite, encoding="utf-8")
    (directory / "paper" / "published.csv").write_text(published, encoding="utf-8")
    return directory


def test_the_papers() -> None:
    assert "fractional_hcw" in PAPERS
    assert "out_of_plane" in read_suite("fractional_hcw").sections
    assert all((suites_directory() / paper / "README.md").is_file() for paper in PAPERS)


@pytest.mark.parametrize(("paper", "section"), SECTIONS)
def test_every_row_has_a_recipe_that_can_be_computed(paper: str, section: str) -> None:
    """The experiments exist, and their optima have the rows and columns that the recipes name."""
    wanted = read_suite(paper).sections[section]
    for words in (wanted.sampling, []):
        evaluations = {}
        for name in wanted.experiments:
            config = compose([f"experiment={name}", *words])
            evaluations[name], survey = build_checked(config)
            for point in wanted.points.values():
                if (point.experiment or wanted.experiment) == name:
                    assert point.initial_condition in evaluations[name].initial_conditions
                    assert point.objective in evaluations[name].objectives
                    assert point.kind in KINDS
                    assert point.kind != "slice" or survey.slices
                    assert point.kind != "baseline" or survey.baseline
                    assert set(point.where) <= {"slice", *evaluations[name].row_columns}
        for recipe in wanted.rows.values():
            for point_name in recipe.points:
                name = wanted.points[point_name].experiment or wanted.experiment
                assert recipe.column in evaluations[name].row_columns


@pytest.mark.parametrize(("paper", "section"), SECTIONS)
def test_a_suite_overrides_the_sampling_only(paper: str, section: str) -> None:
    sampling = read_suite(paper).sections[section].sampling
    assert bool(sampling) == (paper == "fractional_hcw"), "other papers' numbers do not come from samples"
    assert [word for word in sampling if not re.fullmatch(r"measures\.\w+\.resolution=[\d.]+", word)] == []


@pytest.mark.parametrize("paper", PAPERS)
def test_tolerances_are_one_unit_of_the_last_digit(paper: str) -> None:
    suite = read_suite(paper)
    for row in suite.published.values():
        if row.published.relation == "=":
            assert row.tolerance in (Decimal(0), row.published.last_digit), row.id
        assert row.place
        assert row.quantity


@pytest.mark.parametrize("paper", PAPERS)
def test_every_point_is_used(paper: str) -> None:
    for section in read_suite(paper).sections.values():
        assert set(section.points) == {point for recipe in section.rows.values() for point in recipe.points}


def test_every_number_of_the_tables_is_there() -> None:
    """Yaylali, Butcher, Sinclair, the two tables after Figures 4 and 5, and the numbers of the text before them."""
    rows = [row for row, _ in read_suite("fractional_hcw").rows("out_of_plane")]
    printed = [row.published.text for row in rows if row.place.startswith("table IC")]
    assert " ".join(printed) == "4.12 6.87 2.726 3.01 7.78 2.637 3.52 1.093 1.483 2.79 1.067 1.480"
    efforts = [row.published.text for row in rows if row.published.text.startswith("0.00")]
    assert efforts == ["0.00256", "0.00264", "0.00148", "0.00147"]
    assert [row.published.text for row in rows if row.unit == "T_orb"] == ["0.63", "0.48", "0.56", "0.44"]
    percentages = [row.published.text for row in rows if row.unit == "%" and row.tolerance is not None]
    assert percentages == ["24", "3", "22", "27", "3", "13", "21", "2.4", "0.2"]
    designs = [row for row in rows if row.id.endswith(("_alpha", "_k_p", "_k_d")) and row.tolerance is not None]
    fastest = ["0.55", "2.0", "0.91", "0.85", "2.0", "0.45", "2.0", "0.97", "0.75", "1.95"]
    assert [row.published.text for row in designs] == [*fastest, "1.00", "0.91", "0.97"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("at: best", "at: bst", "sections.one.rows.a: there is no point 'bst'"),
        ("      a: {", "      b: {", "sections.one.rows.b: published.csv has no such row"),
        ("      a: {", "      b: {", "the published row 'a' is in no section"),
        ("column:", "colum:", "sections.one.rows.a.colum"),
        ("kind: overall", "kind: best", "sections.one.points.best.kind"),
        ("    experiment: outofplane\n", "", "sections.one.experiment"),
        ("at: best", "at: best, increase_over: best, reduction_from: best", "either increase_over or reduction_from"),
        ('"Numbers"', '"Numbers', "is not YAML"),
        ("      a: {", "      on: {", "does not read the key 'on' as text"),
    ],
)
def test_mistakes_of_a_suite(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in SUITE
    with pytest.raises(ConfigurationError) as caught:
        read_suite("paper", folder(tmp_path, SUITE.replace(old, new)))
    assert str(caught.value).startswith(str(tmp_path / "paper"))
    assert said in str(caught.value)


def test_a_row_of_two_sections_is_refused(tmp_path: Path) -> None:
    second = SUITE[SUITE.index("  one:") :].replace("  one:", "  two:")
    with pytest.raises(ConfigurationError, match=r"sections\.two\.rows\.a: another section has it too"):
        read_suite("paper", folder(tmp_path, SUITE + second))


def test_only_folders_with_a_suite_are_papers(tmp_path: Path) -> None:
    (folder(tmp_path) / "notes").mkdir()
    assert suite_names(tmp_path) == ["paper"]
    assert suite_names(tmp_path / "absent") == []
    with pytest.raises(ConfigurationError, match="cannot read"):
        read_suite("notes", tmp_path)


TABLE = pd.DataFrame(
    {
        "initial_condition": ["ic1", "ic1", "ic1", "ic1"],
        "objective_name": ["st"] * 4,
        "kind": ["overall", "baseline", "slice", "slice"],
        "slice": [None, None, 0.9, 1.0],
        "st": [3.0, 4.0, 3.5, 4.0],
        "stable": pd.array([True, False, None, True], dtype="boolean"),
    }
)


def number(**recipe: object) -> float | None:
    points = {
        "best": Point(initial_condition="ic1", objective="st", kind="overall"),
        "base": Point(initial_condition="ic1", objective="st", kind="baseline"),
        "slice": Point(initial_condition="ic1", objective="st", kind="slice", where={"slice": 0.9}),
        "other": Point(initial_condition="ic1", objective="st", kind="overall", experiment="other"),
        "none": Point(initial_condition="ic2", objective="st", kind="overall"),
    }
    tables = {"own": TABLE, "other": TABLE.assign(st=10.0)}
    return RunOptima(points, tables, "own").number(Recipe.model_validate({"column": "st", **recipe}))


def test_recipes() -> None:
    assert number(at="best") == 3.0
    assert number(at="slice") == 3.5
    assert number(at="other") == 10.0
    assert number(at="best", reduction_from="base") == pytest.approx(0.25)
    assert number(at="base", increase_over="best") == pytest.approx(1.0 / 3.0)
    assert number(at=["base", "slice", "other"]) == 3.5
    assert number(at=["best", "base"], column="stable") == 0.0


def test_recipes_without_a_result() -> None:
    assert number(at="none") is None
    assert number(at=["best", "none"]) is None
    assert number(at="best", reduction_from="none") is None
    assert number(at="best", column="absent") is None
    assert number(at="slice", column="stable") is None
