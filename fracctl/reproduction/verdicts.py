"""Whether a computed number is the published one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal

from fracctl.reproduction.published import NOT_DECIDABLE, NOT_REPRODUCED, REPRODUCED, Printed, PublishedRow

_DIGITS_OF_A_CLAIM = 4


@dataclass(frozen=True)
class Verdict:
    """What became of a published row."""

    word: str
    """``reproduced``, ``not_reproduced`` or ``not_decidable``."""
    difference: Decimal | None
    """Computed, as `shown`, less published; None for a claim, or if nothing was computed."""


def judge(row: PublishedRow, computed: float | None) -> Verdict:
    """Compare a computed number, in the row's unit, with the published one.

    A number is reproduced if it differs by no more than the tolerance when it is written with one digit more than the
    paper prints; a claim if it holds, and infinite is more than any bound. What the paper leaves undecidable stays so,
    whatever is computed.
    """
    number = shown(computed, row.published)
    difference = None if number is None or row.tolerance is None else number - row.published.number
    if row.expected == NOT_DECIDABLE:
        return Verdict(NOT_DECIDABLE, difference)
    if computed is None or math.isnan(computed):
        return Verdict(NOT_REPRODUCED, difference)
    if row.tolerance is not None:
        holds = difference is not None and abs(difference) <= row.tolerance
    else:
        bound = float(row.published.number)
        holds = computed > bound if row.published.relation == ">" else computed < bound
    return Verdict(REPRODUCED if holds else NOT_REPRODUCED, difference)


def shown(computed: float | None, printed: Printed) -> Decimal | None:
    """Return a number with one digit more than the paper prints, with four beside a claim; None if there is none."""
    if computed is None or not math.isfinite(computed):
        return None
    if printed.relation != "=":
        return Decimal(f"{computed + 0.0:.{_DIGITS_OF_A_CLAIM}g}")
    return Decimal(computed).quantize(printed.last_digit.scaleb(-1), ROUND_HALF_EVEN)
