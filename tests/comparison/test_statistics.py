"""Paired ratios against what is known of them, and the verdict at its limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracctl.comparison.statistics import best_ratio, paired_ratio, verdict

NONE = (math.nan, math.nan)


def test_equal_ratios_leave_no_doubt() -> None:
    reference = np.array([1.0, 2.0, 5.0, 0.3])
    found = paired_ratio(0.9 * reference, reference, (1,))
    assert (found.pairs, found.middle, found.lower, found.upper) == (4, *(pytest.approx(0.9, rel=1e-12),) * 3)


def test_the_interval_is_that_of_the_normal_law_for_many_pairs() -> None:
    random = np.random.default_rng(5)
    logarithms = -0.1 + 0.2 * random.standard_normal(2000)
    reference = np.exp(random.standard_normal(2000))
    found = paired_ratio(reference * np.exp(logarithms), reference, (2,))
    half = 1.96 * logarithms.std() / math.sqrt(2000.0)
    assert math.log(found.middle) == pytest.approx(logarithms.mean(), rel=1e-12)
    assert math.log(found.upper / found.lower) == pytest.approx(2.0 * half, rel=0.06)


def test_pairs_hold_what_both_have_found() -> None:
    found = paired_ratio(np.array([1.0, np.inf, 3.0]), np.array([2.0, 2.0, np.inf]), (3,))
    assert (found.pairs, found.middle) == (1, pytest.approx(0.5))
    assert math.isnan(paired_ratio(np.array([np.inf]), np.array([1.0]), (3,)).middle)


@pytest.mark.parametrize(
    ("ratio", "word"), [(0.5, "better"), (0.9799, "better"), (0.981, "equal"), (1.019, "equal"), (1.0201, "worse")]
)
def test_two_percent_decide(ratio: float, word: str) -> None:
    assert verdict(3.0 * ratio, 3.0, NONE) == word


def test_what_one_law_cannot_do_at_all() -> None:
    assert verdict(1.0, math.inf, NONE) == "better"
    assert verdict(math.inf, 1.0, NONE) == "worse"
    assert verdict(math.inf, math.inf, NONE) == "undecided"


def test_an_interval_must_agree_where_a_search_might_have_missed_something() -> None:
    searched = (False, False)
    assert verdict(0.9, 1.0, (0.85, 0.95), exact=searched) == "better"
    assert verdict(0.9, 1.0, (0.85, 1.05), exact=searched) == "undecided"
    assert verdict(1.0, 1.0, (0.99, 1.01), exact=searched) == "equal"
    assert verdict(0.9, 1.0, NONE, exact=searched) == "undecided"


def test_a_point_that_is_found_proves_that_a_law_is_better_than_a_grid() -> None:
    spread = (0.8, 1.2)
    assert verdict(0.9, 1.0, spread, exact=(False, True)) == "better"
    assert verdict(1.1, 1.0, spread, exact=(False, True)) == "undecided"
    assert verdict(1.1, 1.0, spread, exact=(True, False)) == "worse"
    assert verdict(0.9, 1.0, spread, exact=(True, False)) == "undecided"


def test_the_interval_of_best_ratios_leaves_out_what_one_start_in_five_has_found() -> None:
    """The best of n drawn of n starts is the i-th best or worse with probability ((n - i + 1) / n)^n."""
    law, reference = np.array([0.5, 0.8, 0.9, 0.95, 0.97]), np.ones(5)
    assert best_ratio(law, reference, (1,)) == (0.5, 0.9), "(3/5)^5 = 0.08 and (2/5)^5 = 0.01 lie about 0.025"
    lower, upper = best_ratio(reference, law, (1,))
    assert (lower, upper) == (pytest.approx(1.0 / 0.9), 2.0)


def test_pairs_are_drawn_together() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0])
    assert best_ratio(0.9 * values, values, (1,)) == pytest.approx((0.9, 0.9))


def test_starts_that_find_nothing() -> None:
    nothing, one = np.full(3, np.inf), np.array([1.0, np.inf, np.inf])
    assert all(math.isnan(end) for end in best_ratio(nothing, nothing, (1,)))
    assert best_ratio(nothing, np.ones(3), (1,)) == (math.inf, math.inf)
    assert best_ratio(np.ones(3), nothing, (1,)) == (0.0, 0.0)
    assert best_ratio(one, np.ones(3), (1,)) == (1.0, math.inf), "(2/3)^3 = 0.30 of the draws are without it"
