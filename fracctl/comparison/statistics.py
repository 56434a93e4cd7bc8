"""Paired statistics of searches, and the verdict that is decided in advance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Floats

BETTER, EQUAL, WORSE, UNDECIDED = "better", "equal", "worse", "undecided"
MARGIN = 0.02
"""Laws within this ratio of each other are equal."""
_RESAMPLES = 2000
_LEVEL = 0.95


@dataclass(frozen=True)
class Ratio:
    """How a law's starts compare with those of the reference."""

    pairs: int
    """Starts in which both found something."""
    middle: float
    """Geometric mean of the paired ratios; NaN without pairs."""
    lower: float
    upper: float
    """Bootstrap interval of it, 95 %."""


def paired_ratio(values: Floats, reference: Floats, seed: Sequence[int]) -> Ratio:
    """Return the ratio of paired values, with its percentile bootstrap interval over the pairs.

    Args:
        values: of each start, (s,); infinite where nothing was found.
        reference: of the same starts, (s,).
        seed: of the resampling.

    Source: B. Efron, R. Tibshirani, An Introduction to the Bootstrap (1993), section 13.3.
    """
    both = np.isfinite(values) & np.isfinite(reference) & (values > 0.0) & (reference > 0.0)
    logarithms = np.log(values[both] / reference[both])
    if not logarithms.size:
        return Ratio(0, math.nan, math.nan, math.nan)
    random = np.random.default_rng(list(seed))
    means = logarithms[random.integers(logarithms.size, size=(_RESAMPLES, logarithms.size))].mean(axis=1)
    lower, upper = np.quantile(means, [0.5 - 0.5 * _LEVEL, 0.5 + 0.5 * _LEVEL])
    return Ratio(int(logarithms.size), *(float(math.exp(x)) for x in (logarithms.mean(), lower, upper)))


def best_ratio(values: Floats, reference: Floats, seed: Sequence[int]) -> tuple[float, float]:
    """Return the percentile bootstrap interval, 95 %, of the ratio of the best values over paired starts.

    It says whether the ratio hangs on one lucky start: with five starts, what three of them have found is in it. It
    cannot say how much better points lie that no start has found.

    Args:
        values: of each start, (s,); infinite where nothing was found.
        reference: of the same starts, (s,).
        seed: of the resampling.

    Returns:
        Its ends; 0 or infinity where only the one or the other has found something, NaN where none has.
    """
    if not values.size:
        return math.nan, math.nan
    drawn = np.random.default_rng(list(seed)).integers(values.size, size=(_RESAMPLES, values.size))
    law, other = values[drawn].min(axis=1), reference[drawn].min(axis=1)
    either = np.isfinite(law) | np.isfinite(other)
    if not either.any():
        return math.nan, math.nan
    ratios = np.where(np.isfinite(other[either]), law[either] / other[either], 0.0)
    ends = np.quantile(ratios, [0.5 - 0.5 * _LEVEL, 0.5 + 0.5 * _LEVEL], method="nearest")
    return float(ends[0]), float(ends[1])


def verdict(
    value: float, reference: float, interval: tuple[float, float], *, exact: tuple[bool, bool] = (True, True)
) -> str:
    """Return whether a law is better than the reference, equal within 2 %, or worse.

    The best values decide. Where no grid has shown that one of them is the best there is, another one might lie
    below it and change the word; then the interval of their ratio must hold no other word, or it is ``undecided``.

    Args:
        value: best objective of the law, infinite if it has none.
        reference: the same of the law it is compared with.
        interval: of their ratio over the starts of both.
        exact: whether the law, and the reference, were computed over a grid.
    """
    if not (math.isfinite(value) or math.isfinite(reference)):
        return UNDECIDED
    word = _word(value / reference if math.isfinite(reference) else 0.0)
    law_doubtful, reference_doubtful = not exact[0] and word != BETTER, not exact[1] and word != WORSE
    if not (law_doubtful or reference_doubtful) or {_word(end) for end in interval} == {word}:
        return word
    return UNDECIDED


def _word(ratio: float) -> str:
    if ratio < 1.0 - MARGIN:
        return BETTER
    return EQUAL if ratio <= 1.0 + MARGIN else WORSE
