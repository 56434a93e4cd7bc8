"""Uncertain numbers against their distributions, and the intervals of quantiles against the binomial law."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from fracctl.dispersions import QUANTILES, Distribution, draws, quantile_interval, spread, spreads
from fracctl.errors import ArgumentError

COUNT = 4000
DISTRIBUTIONS = {
    "speed": Distribution.of(["normal", 0.7, 0.02]),
    "phase": Distribution.of(["uniform", 1.0, 4.0]),
    "sign": Distribution.of(["choice", -1, 1, 3]),
}


@pytest.fixture(scope="module")
def drawn() -> dict[str, np.ndarray]:
    return draws(DISTRIBUTIONS, DISTRIBUTIONS, 0, range(COUNT))


def test_normal_numbers(drawn: dict[str, np.ndarray]) -> None:
    assert stats.kstest(drawn["speed"], stats.norm(0.7, 0.02).cdf).pvalue > 0.01
    assert drawn["speed"].mean() == pytest.approx(0.7, abs=4 * 0.02 / math.sqrt(COUNT))
    assert drawn["speed"].std() == pytest.approx(0.02, rel=4 / math.sqrt(2 * COUNT))


def test_uniform_numbers(drawn: dict[str, np.ndarray]) -> None:
    assert stats.kstest(drawn["phase"], stats.uniform(1.0, 3.0).cdf).pvalue > 0.01
    assert drawn["phase"].min() >= 1.0
    assert drawn["phase"].max() <= 4.0


def test_chosen_numbers(drawn: dict[str, np.ndarray]) -> None:
    values, counts = np.unique(drawn["sign"], return_counts=True)
    assert values.tolist() == [-1.0, 1.0, 3.0]
    assert stats.chisquare(counts).pvalue > 0.01


def test_numbers_of_a_sample_are_independent(drawn: dict[str, np.ndarray]) -> None:
    table = np.corrcoef([drawn["speed"], drawn["phase"], drawn["sign"]])
    assert np.abs(table - np.eye(3)).max() < 4 / math.sqrt(COUNT)
    assert abs(np.corrcoef(drawn["speed"][:-1], drawn["speed"][1:])[0, 1]) < 4 / math.sqrt(COUNT)


def test_a_sample_can_be_drawn_again_by_its_number(drawn: dict[str, np.ndarray]) -> None:
    again = draws(DISTRIBUTIONS, DISTRIBUTIONS, 0, [17])
    assert {name: values.tolist() for name, values in again.items()} == {n: [v[17]] for n, v in drawn.items()}
    assert draws(DISTRIBUTIONS, DISTRIBUTIONS, 1, [17])["speed"] != again["speed"], "another seed, other numbers"


def test_the_order_in_which_distributions_are_given_plays_no_part(drawn: dict[str, np.ndarray]) -> None:
    backwards = draws(dict(reversed(DISTRIBUTIONS.items())), DISTRIBUTIONS, 0, range(20))
    assert {n: v.tolist() for n, v in backwards.items()} == {n: v[:20].tolist() for n, v in drawn.items()}


def test_no_spread_is_the_mean() -> None:
    sure = {"a": Distribution("normal", (0.7, 0.0)), "b": Distribution("uniform", (2.0, 2.0))}
    table = draws({**sure, "c": Distribution("choice", (5.0,))}, "abc", 3, range(4))
    assert {name: set(values.tolist()) for name, values in table.items()} == {"a": {0.7}, "b": {2.0}, "c": {5.0}}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["norml", 0, 1], "must be one of normal, uniform, choice; did you mean 'normal'?"),
        (["normal", 0], "must hold 'normal' and 2 or 4 numbers"),
        (["normal", 0, 1, 2], "must hold 'normal' and 2 or 4 numbers"),
        (["normal", 0, 1, 1, 2], "must have its mean between the lowest and the highest value"),
        (["uniform", 0, 1, 2], "must hold 'uniform' and 2 numbers"),
        (["choice"], "must hold 'choice' and numbers"),
        (["normal", math.nan, 1], "must hold 'normal' and 2 or 4 numbers"),
        (["uniform", 0, math.inf], "must hold 'uniform' and 2 numbers"),
        (["normal", 0, -1], "must have a deviation of at least 0"),
        (["uniform", 2, 1], "must have its lowest value first"),
        (["normal", "a", 1], "must be a list as [normal, 0.7, 0.02]"),
        (["normal", True, 1], "must be a list as [normal, 0.7, 0.02]"),
        ([], "must be a list as [normal, 0.7, 0.02]"),
    ],
)
def test_what_is_no_distribution(given: list[Any], said: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        Distribution.of(given)
    assert caught.value.name == "distribution"
    assert caught.value.allowed == said


@pytest.mark.parametrize("share", QUANTILES)
@pytest.mark.parametrize("count", [10, 59, 93, 200, 1000])
def test_an_interval_covers_by_the_binomial_law(count: int, share: float) -> None:
    """P(X_(i) < q <= X_(j)) = P(i <= B < j) with places from 1, for B of binom(count, share)."""
    low, high = quantile_interval(count, share)
    number = np.arange(count + 1)
    chances = np.array([math.comb(count, int(k)) * share**k * (1 - share) ** (count - k) for k in number])
    above = number >= (0 if low is None else low + 1)
    below = number < (count + 1 if high is None else high + 1)
    assert chances[above & below].sum() >= 0.95
    if low is not None:
        assert chances[number <= low].sum() <= 0.025 + 1e-12, "no more than the tail's share is below"
        assert chances[number <= low + 1].sum() > 0.025, "a place more would be too many"
    if high is not None:
        assert chances[number >= high + 1].sum() <= 0.025 + 1e-12
        assert chances[number >= high].sum() > 0.025


def test_few_samples_have_no_bound() -> None:
    """All of n samples are below the 95 % quantile with a chance of 0.95ⁿ: under 2.5 % from n = 72 on."""
    assert 0.95**71 > 0.025 > 0.95**72
    assert quantile_interval(71, 0.95)[1] is None
    assert quantile_interval(72, 0.95)[1] == 71
    assert quantile_interval(72, 0.05)[0] == 0
    assert quantile_interval(71, 0.05)[0] is None
    found = spread(np.arange(3), np.array([2.0, 1.0, 3.0]))
    assert found["quantile_95_high"] == math.inf
    assert found["quantile_05_low"] == -math.inf


def test_intervals_cover_the_quantile_in_simulation() -> None:
    random = np.random.default_rng(2)
    tables = np.sort(random.exponential(size=(4000, 200)), axis=1)
    low, high = quantile_interval(200, 0.95)
    assert low is not None
    assert high is not None
    exact = -math.log(0.05)
    covered = ((tables[:, low] < exact) & (exact <= tables[:, high])).mean()
    assert covered >= 0.95 - 3 * math.sqrt(0.05 * 0.95 / 4000)
    assert covered < 0.99, "no wider than need be"


def test_quantiles_are_values_and_extremes_name_their_samples() -> None:
    numbers = np.arange(101)
    values = np.random.default_rng(3).permutation(numbers).astype(float)
    found = spread(numbers + 1000, values)
    assert (found["quantile_05"], found["median"], found["quantile_95"]) == (5.0, 50.0, 95.0)
    assert (found["smallest"], found["largest"]) == (0.0, 100.0)
    assert values[int(found["smallest_sample"]) - 1000] == 0.0
    assert values[int(found["largest_sample"]) - 1000] == 100.0


def test_what_never_comes_counts_as_latest_and_what_is_no_number_not_at_all() -> None:
    found = spread(np.arange(5), np.array([np.inf, 1.0, np.nan, 2.0, np.inf]))
    assert (found["smallest"], found["median"], found["largest"]) == (1.0, 2.0, math.inf)
    assert found["largest_sample"] in (0.0, 4.0)
    assert all(math.isnan(value) for value in spread(np.arange(2), np.full(2, np.nan)).values())


def test_groups_are_kept_apart() -> None:
    rows = {
        "law": np.array(["one", "two", "one", "two"], dtype=object),
        "sample": np.array([0.0, 0.0, 1.0, 1.0]),
        "time": np.array([1.0, 10.0, 2.0, 20.0]),
    }
    first, second = spreads(rows, ["law"], ["time"])
    assert (first["law"], first["measure"], first["samples"], first["largest"]) == ("one", "time", 2, 2.0)
    assert (second["law"], second["smallest"], second["largest"]) == ("two", 10.0, 20.0)


@pytest.mark.parametrize(("mean", "low", "high"), [(0.0, 0.0, 0.05), (0.3, 0.29, 0.4), (1.0, -9.0, 1.01)])
def test_normal_numbers_between_bounds(mean: float, low: float, high: float) -> None:
    found = draws({"e": Distribution.of(["normal", mean, 0.02, low, high])}, "e", 0, range(COUNT))["e"]
    expected = stats.truncnorm((low - mean) / 0.02, (high - mean) / 0.02, mean, 0.02)
    assert stats.kstest(found, expected.cdf).pvalue > 0.01
    assert low <= found.min()
    assert found.max() <= high


def test_what_a_distribution_reaches() -> None:
    assert Distribution.of(["normal", 1.0, 0.1]).ends == pytest.approx((0.4, 1.6))
    assert Distribution.of(["normal", 1.0, 0.1, 0.9, 5.0]).ends == pytest.approx((0.9, 1.6))
    assert Distribution.of(["uniform", -2.0, 3.0]).ends == (-2.0, 3.0)
    assert Distribution.of(["choice", 4, -1, 2]).ends == (-1.0, 4.0)
