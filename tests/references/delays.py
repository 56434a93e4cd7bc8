"""Linear delay equations in arbitrary precision, by Taylor series on pieces that all delays are multiples of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import mpmath
import numpy as np

_TERMS = 40
_DIGITS = 40


@dataclass(frozen=True)
class Term:
    """-K (x - W), W(t) = (1 - R) x(t - τ) + R W(t - τ) from `switch_on` on; W of the history is the history."""

    gain: Sequence[Sequence[float]]
    delay: Fraction
    switch_on: Fraction = Fraction(0)
    recall: float = 0.0


def linear(
    matrix: Sequence[Sequence[float]],
    terms: Sequence[Term],
    history: Callable[[Fraction], Sequence[float]],
    start: Sequence[float],
    piece: Fraction,
    times: Sequence[Fraction],
    reference_from: Fraction = Fraction(0),
) -> np.ndarray:
    """Return x at times of x' = A x + Σ_j -K_j (x - W_j) with a history that is constant on each piece, (t, n).

    Args:
        matrix: A.
        terms: of the control; delays and switch-on are multiples of `piece`.
        history: the state on the piece that begins at the time given.
        start: x(0).
        piece: length of a piece.
        times: positive.
        reference_from: before this W is x itself (a free motion that begins at time 0, with the delay).
    """
    with mpmath.workdps(_DIGITS):
        a, gains = mpmath.matrix(matrix), [mpmath.matrix(term.gain) for term in terms]
        longest = max((int(term.delay / piece) for term in terms), default=0)
        constants = [mpmath.matrix([mpmath.mpf(v) for v in history(k * piece)]) for k in range(-longest, 0)]
        blank = mpmath.zeros(len(start), 1)
        states = {k - longest: [c] + [blank] * _TERMS for k, c in enumerate(constants)}
        references = [dict(states) for _ in terms]
        x = mpmath.matrix([mpmath.mpf(v) for v in start])
        pieces = max(int(t / piece) for t in times) + 1
        for k in range(pieces):
            known = k * piece >= reference_from
            for w, term in zip(references, terms, strict=True):
                back, recall = k - int(term.delay / piece), mpmath.mpf(term.recall)
                w[k] = [(1 - recall) * p + recall * q for p, q in zip(states[back], w[back], strict=True)]
            on = [
                gain if known and k * piece >= term.switch_on else 0 * gain
                for gain, term in zip(gains, terms, strict=True)
            ]
            series = [x]
            for i in range(_TERMS):
                rate = a * series[i]
                for gain, w in zip(on, references, strict=True):
                    rate -= gain * (series[i] - w[k][i])
                series.append(rate / (i + 1))
            states[k] = series
            for w in references if not known else ():
                w[k] = series
            x = _value(series, piece)
        found = [_value(states[int(t / piece)], t - int(t / piece) * piece) for t in times]
        return np.array([[float(v) for v in x] for x in found])


def _value(series: Sequence[mpmath.matrix], time: Fraction) -> mpmath.matrix:
    t = mpmath.mpf(time.numerator) / time.denominator
    total = series[-1]
    for c in reversed(series[:-1]):
        total = c + t * total
    return total
