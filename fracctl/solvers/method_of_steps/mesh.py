"""The steps of the method of steps: every time at which a solution is not smooth is the end of a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from fracctl.arrays import Floats
from fracctl.controllers.delayed_feedback import DelayedTerm

_ORDER = 9
"""A jump is felt in a derivative one higher after every delay; beyond this one the method does not see it."""
_SAME = 1e-10
"""Two times closer than this share of a delay are one."""


@dataclass(frozen=True)
class Mesh:
    """The steps of b members."""

    edges: Floats
    """Ends of the steps, (b, S + 1), from 0 to the horizon or beyond."""
    back: int | None
    """Number of steps that make up the one delay; None where delayed times are looked up."""
    shares: Floats | None
    """Ends of the steps of one delay over the delay, (b, back + 1)."""


def mesh_of(terms: Sequence[DelayedTerm], history_breaks: Sequence[float], steps: int, horizon: float) -> Mesh:
    """Return a mesh with `steps` steps to the shortest delay, or to 2π where there is none.

    Args:
        terms: with batch axes.
        history_breaks: times in (-τ, 0) of jumps and kinks.
        steps: N.
        horizon: S > 0, the last time.
    """
    if not terms:
        count = int(np.ceil(horizon * steps / (2.0 * np.pi) * (1.0 - 1e-12)))
        return Mesh(np.linspace(0.0, horizon, count + 1)[None], None, None)
    if len(terms) > 1:
        return Mesh(_padded(terms, history_breaks, steps, horizon), None, None)
    delay, breaks = terms[0].delay, [*history_breaks]
    shares = np.stack([_shares([s / d, *(t / d for t in breaks)], steps) for s, d in _pairs(terms[0])])
    periods = int(np.ceil(horizon / delay.min() * (1.0 - 1e-12)))
    edges = delay[:, None] * (np.arange(periods)[:, None] + shares[:, None, :-1]).reshape(len(delay), -1)
    edges = np.concatenate([edges, periods * delay[:, None]], axis=1)
    needed = int(np.argmax(np.all(edges >= horizon * (1.0 - 1e-12), axis=0)))
    return Mesh(np.ascontiguousarray(edges[:, : needed + 1]), steps, shares)


def breaks_of(
    terms: Sequence[DelayedTerm], history_breaks: Sequence[float], member: int, horizon: float
) -> list[float]:
    """Return the times at which the solution of a member is not smooth, between 0 and the horizon and with both.

    With one delay all multiples count, since a gain may be renewed and W recall a jump at any of them.
    """
    delays = [float(term.delay[member]) for term in terms]
    if len(delays) == 1:
        sums = [k * delays[0] for k in range(1, 2 + int(horizon / delays[0]))]
    else:
        sums = [sum(c) for k in range(1, _ORDER + 1) for c in combinations_with_replacement(delays, k)]
    starts = [0.0, *history_breaks, *(float(term.switch_on[member]) for term in terms)]
    times = sorted({t for s in starts for t in (s, *(s + d for d in sums)) if 0.0 < t < horizon})
    same = _SAME * min(delays, default=horizon)
    kept = [t for j, t in enumerate(times) if t - (times[j - 1] if j else 0.0) > same and horizon - t > same]
    return [0.0, *kept, horizon]


def _pairs(term: DelayedTerm) -> list[tuple[float, float]]:
    return list(zip(term.switch_on.tolist(), term.delay.tolist(), strict=True))


def _shares(breaks: Sequence[float], steps: int) -> Floats:
    """Divide [0, 1] into `steps` steps, nearly equal, that end at the fractional parts of the breaks."""
    parts = sorted(part for part in (b % 1.0 for b in breaks) if _SAME < part < 1.0 - _SAME)
    ends = [0.0, *(p for i, p in enumerate(parts) if i == 0 or p - parts[i - 1] > _SAME), 1.0]
    counts = np.maximum(np.round(np.diff(np.round(np.array(ends) * steps))), 1).astype(int)
    counts[np.argmax(counts)] += steps - counts.sum()
    return _filled(ends, counts.tolist())


def _filled(ends: Sequence[float], counts: Sequence[int]) -> Floats:
    spans = zip(ends[:-1], ends[1:], counts, strict=True)
    return np.concatenate([np.linspace(a, b, n + 1)[:-1] for a, b, n in spans] + [[ends[-1]]])


def _padded(terms: Sequence[DelayedTerm], history_breaks: Sequence[float], steps: int, horizon: float) -> Floats:
    """Return steps of at most the shortest delay over `steps`, as many for every member."""
    rows = []
    for i in range(len(terms[0].delay)):
        longest = min(float(term.delay[i]) for term in terms) / steps
        ends = breaks_of(terms, history_breaks, i, horizon)
        rows.append(_filled(ends, np.ceil(np.diff(ends) / longest * (1.0 - 1e-12)).astype(int).tolist()))
    most = max(len(row) for row in rows)
    step = min(float(term.delay.min()) for term in terms) / steps
    return np.stack([np.append(row, horizon + step * np.arange(1, most - len(row) + 1)) for row in rows])
