"""A linear law as fractional integrals of what a step knows of the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.controllers.linear import LinearLawTerms

_SAME = 1e-12
"""Orders nearer than this to a whole number are that number."""


@dataclass(frozen=True)
class Signals:
    """The demand w and the rates of the auxiliary states, [w, z'] = Σ_f G_f I^{p_f} s_f.

    s_f is one of the entries of [ξ, ξ', ξ'', z, z'], p_f lies in [0, 1]: D^β y = I^(k-β) y^(k), k = ⌈β⌉, and k = 0 for
    the integrals with β < 0.
    """

    n_positions: int
    """m."""
    n_auxiliary: int
    """q."""
    sources: Array
    """Places of the s_f, (F,)."""
    orders: Floats
    """p, (F, b), or (F, 1) where all members share them."""
    gains: Floats
    """G, (b, m + q, F) or (1, m + q, F)."""

    def take(self, rows: Array) -> Signals:
        """Return some of the members."""
        orders = self.orders if self.orders.shape[1] == 1 else self.orders[:, rows]
        gains = self.gains if len(self.gains) == 1 else self.gains[rows]
        return Signals(self.n_positions, self.n_auxiliary, self.sources, _shared(orders), gains)


def highest_used(law: LinearLawTerms, n_positions: int) -> tuple[float, float]:
    """Return the highest orders that the law has of positions and of auxiliary states, -inf where there are none."""
    found = [-np.inf, -np.inf]
    for term in law.control + law.auxiliary:
        used = term.matrix.reshape(-1, term.matrix.shape[-1]).any(axis=0)
        for column in np.flatnonzero(used):
            kind = int(column >= n_positions)
            found[kind] = max(found[kind], float(term.orders[..., column].max()))
    return found[0], found[1]


def signals(law: LinearLawTerms, n_positions: int) -> Signals:
    """Return the signals of a law for m positions."""
    m, q = n_positions, law.n_auxiliary
    table: dict[tuple[int, bytes], tuple[Floats, Floats]] = {}
    for terms, row in ((law.control, 0), (law.auxiliary, m)):
        for term in terms:
            for column in range(m + q):
                beta = np.atleast_1d(term.orders[..., column])
                matrix = term.matrix.reshape(-1, *term.matrix.shape[-2:])[..., column]
                whole = np.round(beta)
                beta = np.where(np.abs(beta - whole) < _SAME, whole, beta)
                kinds = np.maximum(np.ceil(beta), 0.0).astype(int)
                for kind in np.unique(kinds):
                    gain = matrix * (kinds == kind)[:, None]
                    if gain.any():
                        p = _shared(np.where(kinds == kind, kind - beta, kind - beta[kinds == kind][0])[None])
                        source = kind * m + column if column < m else 2 * m + kind * q + column
                        full = np.zeros((len(gain), m + q))
                        full[:, row : row + gain.shape[1]] = gain
                        _, before = table.get((source, p.tobytes()), (p, 0.0))
                        table[source, p.tobytes()] = p, np.asarray(before + full)
    if not table:
        return Signals(m, q, np.zeros(0, dtype=np.intp), np.zeros((0, 1)), np.zeros((1, m + q, 0)))
    exponents, gains = zip(*table.values(), strict=True)
    b = max(len(gain) for gain in gains)
    return Signals(
        m,
        q,
        np.array([source for source, _ in table]),
        _stacked(exponents),
        np.stack([np.broadcast_to(gain, (b, m + q)) for gain in gains], axis=-1),
    )


def _stacked(orders: tuple[Floats, ...]) -> Floats:
    widest = max(one.shape[1] for one in orders)
    return np.concatenate([np.broadcast_to(one, (1, widest)) for one in orders])


def _shared(orders: Floats) -> Floats:
    """Drop the batch axis of orders (F, b) that all members share."""
    return orders[:, :1] if np.all(orders == orders[:, :1]) else orders
