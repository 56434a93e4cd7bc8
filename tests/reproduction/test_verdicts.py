"""Verdicts at their edges: what one unit of the last printed digit is, and what the three words mean."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest

from fracctl.reproduction.published import Printed, PublishedRow
from fracctl.reproduction.verdicts import judge, shown


def row(published: str, tolerance: str | None = None, expected: str = "reproduced") -> PublishedRow:
    relation, _, number = published.rpartition(" ")
    printed = Printed(published, relation or "=", Decimal(number))
    limit = None if tolerance is None else Decimal(tolerance)
    return PublishedRow("x", "Table 1", "a number", "1", printed, limit, expected, "")


@pytest.mark.parametrize(
    ("published", "tolerance", "computed", "word", "difference"),
    [
        ("0.63", "0.01", 0.6303, "reproduced", "0.000"),
        ("0.63", "0.01", 0.6400, "reproduced", "0.010"),
        ("0.63", "0.01", 0.6200, "reproduced", "-0.010"),
        ("0.63", "0.01", 0.6404, "reproduced", "0.010"),
        ("0.63", "0.01", 0.6406, "not_reproduced", "0.011"),
        ("0.63", "0.01", 0.6194, "not_reproduced", "-0.011"),
        ("2.637", "0.001", 2.638004, "reproduced", "0.0010"),
        ("2.637", "0.001", 2.64975, "not_reproduced", "0.0128"),
        ("2.4", "0.1", 2.283, "not_reproduced", "-0.12"),
        ("24", "1", 23.04, "reproduced", "-1.0"),
        ("24", "1", 22.9, "not_reproduced", "-1.1"),
        ("1.00", "0", 1.0, "reproduced", "0.000"),
        ("1.00", "0", 0.99, "not_reproduced", "-0.010"),
        ("2.0", "0.1", 2.0, "reproduced", "0.00"),
        ("-3", "1", -3.4, "reproduced", "-0.4"),
    ],
)
def test_numbers(published: str, tolerance: str, computed: float, word: str, difference: str) -> None:
    verdict = judge(row(published, tolerance), computed)
    assert verdict.word == word
    assert verdict.difference == Decimal(difference)
    assert str(verdict.difference) == difference


@pytest.mark.parametrize(
    ("claim", "computed", "word"),
    [
        ("> 0", 1e-9, "reproduced"),
        ("> 0", 0.0, "not_reproduced"),
        ("> 0", -1e-9, "not_reproduced"),
        ("< 1", 0.97, "reproduced"),
        ("< 1", 1.0, "not_reproduced"),
        ("> 4", math.inf, "reproduced"),
        ("< 4", math.inf, "not_reproduced"),
    ],
)
def test_claims(claim: str, computed: float, word: str) -> None:
    verdict = judge(row(claim), computed)
    assert verdict.word == word
    assert verdict.difference is None


@pytest.mark.parametrize(
    ("published", "computed"),
    [("0.63", None), ("0.63", math.nan), ("0.63", math.inf), ("> 0", None), ("> 0", math.nan), ("< 1", math.nan)],
)
def test_nothing_computed_is_nothing_reproduced(published: str, computed: float | None) -> None:
    verdict = judge(row(published, "0.01" if published == "0.63" else None), computed)
    assert verdict.word == "not_reproduced"
    assert verdict.difference is None


def test_the_expected_word_decides_nothing_but_what_cannot_be_decided() -> None:
    for expected in ("reproduced", "not_reproduced"):
        assert judge(row("0.63", "0.01", expected), 0.63).word == "reproduced"
        assert judge(row("0.63", "0.01", expected), 0.73).word == "not_reproduced"
    for computed in (0.63, 0.73, None):
        assert judge(row("0.63", "0.01", "not_decidable"), computed).word == "not_decidable"
    assert judge(row("0.63", "0.01", "not_decidable"), 0.73).difference == Decimal("0.100")


def test_numbers_are_shown_with_one_digit_more_than_printed() -> None:
    for text, computed, expected in (("2.0", 1.95, "1.95"), ("24", 23.99, "24.0"), ("0.00256", 0.0025648, "0.002565")):
        assert str(shown(computed, row(text, "1").published)) == expected
    assert str(shown(43.3871, row("> 0").published)) == "43.39"
    assert str(shown(-0.0, row("> 0").published)) == "0"
    assert shown(math.inf, row("24", "1").published) is None
