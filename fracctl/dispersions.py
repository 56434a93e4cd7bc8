"""Uncertain numbers of a run: distributions, seeded samples, and quantiles of what comes out."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.errors import ArgumentError, suggestion

SAMPLE = "sample"
"""Column that numbers the samples."""
CONFIDENCE = 0.95
"""Of the intervals of quantiles."""
QUANTILES = (0.05, 0.5, 0.95)
_COUNTS: Mapping[str, tuple[int, ...] | None] = {"normal": (2, 4), "uniform": (2,), "choice": None}
_REACH = 6.0
"""Deviations within which normal numbers count as lying; one of 5e8 does not."""


@dataclass(frozen=True)
class Distribution:
    """``[normal, mean, deviation]``, ``[uniform, lowest, highest]`` or ``[choice, value, value, …]``.

    ``[normal, mean, deviation, lowest, highest]`` is the normal distribution of what lies in between.

    Raises:
        ArgumentError: the word is unknown, the numbers are not as many or not finite, a deviation is negative, the
            lowest is above the highest, or the mean outside of both.
    """

    kind: str
    numbers: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.kind not in _COUNTS:
            hint = suggestion(self.kind, _COUNTS)
            raise ArgumentError("distribution", self.kind, f"must be one of {', '.join(_COUNTS)}{hint}")
        wanted, given = _COUNTS[self.kind], list(self.numbers)
        if len(given) not in (wanted or (max(1, len(given)),)) or not all(map(math.isfinite, given)):
            many = "numbers" if wanted is None else f"{' or '.join(map(str, wanted))} numbers"
            raise ArgumentError("distribution", [self.kind, *given], f"must hold '{self.kind}' and {many}")
        if self.kind == "normal" and given[1] < 0.0:
            raise ArgumentError("distribution", [self.kind, *given], "must have a deviation of at least 0")
        if self.kind == "uniform" and given[0] > given[1]:
            raise ArgumentError("distribution", [self.kind, *given], "must have its lowest value first")
        if len(self._bounds) == 2 and not self._bounds[0] <= given[0] <= self._bounds[1]:
            allowed = "must have its mean between the lowest and the highest value"
            raise ArgumentError("distribution", [self.kind, *given], allowed)

    @classmethod
    def of(cls, given: Sequence[Any]) -> Distribution:
        """Return the distribution of a list as in a configuration."""
        if not given or not all(isinstance(n, int | float) and not isinstance(n, bool) for n in given[1:]):
            raise ArgumentError("distribution", given, "must be a list as [normal, 0.7, 0.02]")
        return cls(str(given[0]), tuple(float(number) for number in given[1:]))

    def draw(self, random: np.random.Generator) -> float:
        """Return one number."""
        if self.kind == "normal":
            return self._truncated(random) if self._bounds else float(random.normal(self.numbers[0], self.numbers[1]))
        if self.kind == "uniform":
            return float(random.uniform(self.numbers[0], self.numbers[1]))
        return float(random.choice(np.array(self.numbers)))

    def __str__(self) -> str:
        return f"[{', '.join([self.kind, *(f'{number:g}' for number in self.numbers)])}]"

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest number that is drawn; of a normal distribution 6 deviations from the mean."""
        if self.kind == "normal":
            mean, deviation = self.numbers[:2]
            low, high = self._bounds or (-math.inf, math.inf)
            return max(low, mean - _REACH * deviation), min(high, mean + _REACH * deviation)
        return min(self.numbers), max(self.numbers)

    @property
    def _bounds(self) -> tuple[float, ...]:
        return self.numbers[2:] if self.kind == "normal" else ()

    def _truncated(self, random: np.random.Generator) -> float:
        from scipy.special import ndtr, ndtri

        mean, deviation, low, high = self.numbers
        if deviation == 0.0:
            return mean
        first, last = ndtr((low - mean) / deviation), ndtr((high - mean) / deviation)
        return float(np.clip(mean + deviation * ndtri(random.uniform(first, last)), low, high))


def check_names(dispersions: Collection[str], known: Collection[str]) -> None:
    """Raise ArgumentError unless all that is dispersed is known."""
    for wrong in set(dispersions) - set(known):
        raise ArgumentError("dispersions", wrong, f"must be one of {', '.join(known)}{suggestion(wrong, known)}")


def draws(
    distributions: Mapping[str, Distribution], known: Iterable[str], seed: int, samples: Sequence[int]
) -> dict[str, Floats]:
    """Return the numbers of some samples by name, (s,) each.

    They are drawn one after the other in the order of the `known` names, whatever the order in which distributions are
    given. A sample depends on them, the seed and its own number alone, so that it can be drawn again by itself.
    """
    names = [name for name in known if name in distributions]
    table = {name: np.empty(len(samples)) for name in names}
    for place, sample in enumerate(samples):
        random = np.random.default_rng([seed, sample])
        for name in names:
            table[name][place] = distributions[name].draw(random)
    return table


def quantile_interval(count: int, share: float) -> tuple[int | None, int | None]:
    """Return the places in `count` sorted samples between which a quantile lies with 95 % confidence.

    By order statistics, whatever the distribution; None where there are too few samples for a bound on that side.
    """
    from scipy.stats import binom  # takes half a second, in every worker

    low = int(binom.ppf(0.5 * (1.0 - CONFIDENCE), count, share))
    high = int(binom.ppf(0.5 * (1.0 + CONFIDENCE), count, share)) + 1
    return (low - 1 if low >= 1 else None), (high - 1 if high <= count else None)


def share_interval(count: int, of: int) -> tuple[float, float]:
    """Return the least and the largest chance of what happened `count` times `of` so many, with 95 % confidence.

    The interval of Clopper and Pearson.
    """
    from scipy.stats import binomtest  # takes half a second, in every worker

    found = binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
    return float(found.low), float(found.high)


def spread(samples: Array, values: Floats) -> dict[str, float]:
    """Return quantiles of values, those of the ends with their intervals, and the extremes with their samples.

    Args:
        samples: their numbers, (s,).
        values: (s,); infinite ones count as the largest, those that are no numbers are left out.
    """
    known = ~np.isnan(values)
    order = np.argsort(values[known], kind="stable")
    ranked, numbers = values[known][order], np.asarray(samples)[known][order]
    if not ranked.size:
        return dict.fromkeys(_COLUMNS, math.nan)
    found = [float(np.quantile(ranked, q, method="inverted_cdf")) for q in QUANTILES]
    ends = [_interval(ranked, q) for q in (QUANTILES[0], QUANTILES[-1])]
    extremes = (float(ranked[0]), float(numbers[0]), float(ranked[-1]), float(numbers[-1]))
    return dict(zip(_COLUMNS, (found[0], *ends[0], found[1], found[2], *ends[1], *extremes), strict=True))


_COLUMNS = (
    *("quantile_05", "quantile_05_low", "quantile_05_high", "median"),
    *("quantile_95", "quantile_95_low", "quantile_95_high"),
    *("smallest", "smallest_sample", "largest", "largest_sample"),
)


def _interval(ranked: Floats, share: float) -> tuple[float, float]:
    low, high = quantile_interval(len(ranked), share)
    return (-math.inf if low is None else float(ranked[low])), (math.inf if high is None else float(ranked[high]))


def spreads(rows: Mapping[str, Array], groups: Sequence[str], measures: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield a record for each group of rows and each measure: its groups, the measure, how many samples, `spread`."""
    keys = list(zip(*(rows[name].tolist() for name in groups), strict=True))
    for key in dict.fromkeys(keys):
        places = [place for place, other in enumerate(keys) if other == key]
        for measure in measures:
            values = np.asarray(rows[measure], dtype=np.float64)[places]
            record = dict(zip(groups, key, strict=True)) | {"measure": measure, "samples": len(places)}
            yield record | spread(rows[SAMPLE][places], values)
