"""Free motion about the rotating ellipsoid by Taylor series in arbitrary precision, to where it collides or escapes."""

from __future__ import annotations

from collections.abc import Sequence

import mpmath
from mpmath import mp, mpf

Series = list[mpf]

DIGITS = 28
ORDER = 30


def end(start: Sequence[float], c22: float = 0.052, inner: float = 0.02, outer: float = 5.0) -> mpf:
    """Return the time at which r first reaches `inner` or `outer` from a state [x, y, x', y']."""
    with mp.workdps(DIGITS):
        state, time, shape = [mpf(v) for v in start], mpf(0), 3 * mpf(c22)
        while True:
            series = _series(state, shape)
            terms = [(max(abs(s[m]) for s in series), mpf(1) / m) for m in (ORDER - 1, ORDER)]
            step = min((mpf(10) ** (4 - DIGITS) / size) ** root for size, root in terms)
            state = [_value(s, step) for s in series]
            r = mpmath.hypot(state[0], state[1])
            if not inner < r < outer:
                limit, low, high = (inner, mpf(0), step) if r <= inner else (outer, mpf(0), step)
                for _ in range(80):
                    middle = (low + high) / 2
                    now = mpmath.hypot(_value(series[0], middle), _value(series[1], middle))
                    low, high = (low, middle) if (now < limit) == (r < limit) else (middle, high)
                return time + high
            time += step


def _value(series: Series, step: mpf) -> mpf:
    return mpmath.polyval(series[::-1], step)


def _series(state: Sequence[mpf], shape: mpf) -> tuple[Series, Series, Series, Series]:
    """x'' - 2y' = x (q + 2w), y'' + 2x' = y (q - 2w), w = 3 C₂₂ s^(-5/2), q = 1 - s^(-3/2) - 15 C₂₂ d s^(-7/2),
    with s = x² + y² and d = x² - y².
    """
    x, y, u, v = ([value] for value in state)
    s, d, p3, p5, p7, plus, minus = ([] for _ in range(7))
    for k in range(ORDER):
        xx, yy = _product(x, x, k), _product(y, y, k)
        s.append(xx + yy)
        d.append(xx - yy)
        for power, series in ((3, p3), (5, p5), (7, p7)):
            series.append(_power(series, s, -mpf(power) / 2, k))
        q, w = (k == 0) - p3[k] - 5 * shape * _product(d, p7, k), shape * p5[k]
        plus.append(q + 2 * w)
        minus.append(q - 2 * w)
        u.append((2 * v[k] + _product(x, plus, k)) / (k + 1))
        v.append((-2 * u[k] + _product(y, minus, k)) / (k + 1))
        x.append(u[k] / (k + 1))
        y.append(v[k] / (k + 1))
    return x, y, u, v


def _product(a: Series, b: Series, k: int) -> mpf:
    return mpmath.fsum(a[i] * b[k - i] for i in range(k + 1))


def _power(out: Series, s: Series, exponent: mpf, k: int) -> mpf:
    if k == 0:
        return s[0] ** exponent
    return mpmath.fsum((exponent * j - (k - j)) * s[j] * out[k - j] for j in range(1, k + 1)) / (k * s[0])
