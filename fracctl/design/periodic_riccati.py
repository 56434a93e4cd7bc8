"""The regulator of a linear plant whose matrices repeat themselves, by the Riccati equation iterated backward.

With the cost ∫ (xᵀ Q x + uᵀ R u) dt of x' = A(t) x + B(t) u the regulator is u = -K x,

    K = R⁻¹ Bᵀ P,        -P' = Aᵀ P + P A - P B R⁻¹ Bᵀ P + Q,

and P has the period T of A and B. Between two neighbouring nodes the equation is that of the Hamiltonian system
[x, λ]' = [[A, -B R⁻¹ Bᵀ], [-Q, -Aᵀ]] [x, λ] with λ = P x, for which Gauss's collocation of order 6 gives a map

    P(t) = 𝒬 + 𝒜ᵀ P(t') (I + 𝒢 P(t'))⁻¹ 𝒜,        t < t'.

Maps of neighbours join to maps of the same form; that of a period, doubled until it no longer changes, has the periodic
solution as its 𝒬. Forward the equation is unstable: its errors grow as those of the closed loop decay.

Source: Bittanti, Colaneri, De Nicolao, The Periodic Riccati Equation (1991); for the doubling B. D. O. Anderson, Int.
J. Control 28 (1978) 295.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np

from fracctl.arrays import Floats

_DOUBLINGS = 60
_SETTLED = 1e-13
_PLACES: Floats = 0.5 + np.array([-1.0, 0.0, 1.0]) * np.sqrt(0.15)
"""Nodes of Gauss's quadrature of order 6 on [0, 1]."""
STAGES = len(_PLACES)


def stage_times(edges: Floats) -> Floats:
    """Return the times between neighbours of edges (b, p + 1) at which matrices are wanted, (b, p, 3)."""
    return edges[:, :-1, None] + np.diff(edges, axis=1)[..., None] * _PLACES


def periodic_solution(a: Floats, s: Floats, q: Floats, edges: Floats) -> Floats:
    """Return P at the edges, (b, p + 1, n, n); NaN for members that have no solution.

    Args:
        a: A at `stage_times`, (b, p, 3, n, n).
        s: B R⁻¹ Bᵀ there, (b, p, 3, n, n).
        q: Q, (n, n).
        edges: ends of the panels of one period, (b, p + 1).
    """
    broken = np.array([not (np.isfinite(x).all() and np.isfinite(y).all()) for x, y in zip(a, s, strict=True)])
    a = np.where(broken[:, None, None, None, None], 0.0, a)
    panels = _panels(a, np.where(broken[:, None, None, None, None], 0.0, s), q, np.diff(edges, axis=1))
    period = reduce(lambda later, earlier: _joined(earlier, later), reversed(panels))
    unsettled = np.ones(len(a), dtype=bool)
    for _ in range(_DOUBLINGS):
        doubled = _joined(period, period)
        change, size = (np.abs(m).max(axis=(1, 2)) for m in (doubled.cost - period.cost, doubled.cost))
        unsettled = ~(change <= _SETTLED * size)
        period = doubled
        if not (unsettled & ~broken).any():
            break
    values = [period.cost]
    for panel in reversed(panels):
        values.append(panel.before(values[-1]))
    out = np.stack(values[::-1], axis=1)
    out[broken | unsettled] = np.nan
    return out


@dataclass(frozen=True)
class _Map:
    """What takes P at the end of an interval to P at its start; each (b, n, n)."""

    flow: Floats
    """𝒜."""
    reach: Floats
    """𝒢."""
    cost: Floats
    """𝒬."""

    def before(self, after: Floats) -> Floats:
        """Return P at the start of the interval from that at its end."""
        value: Floats = self.cost + _t(self.flow) @ after @ np.linalg.solve(_one(after) + self.reach @ after, self.flow)
        return 0.5 * (value + _t(value))


def _joined(first: _Map, second: _Map) -> _Map:
    """Return the map of two neighbouring intervals."""
    n = first.flow.shape[-1]
    right = np.concatenate([first.flow, first.reach], axis=-1)
    both = np.linalg.solve(_one(first.flow) + first.reach @ second.cost, right)
    flow, reach = both[..., :n], both[..., n:]
    return _Map(
        second.flow @ flow,
        second.reach + second.flow @ reach @ _t(second.flow),
        first.cost + _t(first.flow) @ second.cost @ flow,
    )


def _panels(a: Floats, s: Floats, q: Floats, widths: Floats) -> list[_Map]:
    """Return the maps of the panels, from the first to the last."""
    n = a.shape[-1]
    hamiltonian = np.concatenate(
        [np.concatenate([a, -s], axis=-1), np.concatenate([np.broadcast_to(-q, a.shape), -_t(a)], axis=-1)], axis=-2
    )
    whole = _transition(hamiltonian, widths)
    x, mixed, down, out = whole[..., :n, :n], whole[..., :n, n:], whole[..., n:, :n], whole[..., n:, n:]
    back = np.linalg.solve(out, np.concatenate([_one(out) + 0.0 * out, down], axis=-1))
    inverse, cost = back[..., :n], -back[..., n:]
    reach = -mixed @ inverse
    maps = zip(*(np.moveaxis(m, 1, 0) for m in (x + mixed @ cost, reach, cost)), strict=True)
    return [_Map(*parts) for parts in maps]


def _transition(hamiltonian: Floats, widths: Floats) -> Floats:
    """Return the transition matrices of z' = H z on the panels, (b, p, 2n, 2n), from H (b, p, 3, 2n, 2n)."""
    b, p, _, size, _ = hamiltonian.shape
    scaled = hamiltonian * widths[..., None, None, None]
    coupled = np.einsum("ij,bpikl->bpikjl", _COEFFICIENTS, scaled).reshape(b, p, STAGES * size, STAGES * size)
    slopes = np.linalg.solve(np.eye(STAGES * size) - coupled, scaled.reshape(b, p, STAGES * size, size))
    change: Floats = np.einsum("i,bpikl->bpkl", _WEIGHTS, slopes.reshape(b, p, STAGES, size, size))
    return np.eye(size) + change


def _integrals(upper: Floats) -> Floats:
    """Return the integrals from 0 to `upper` of the polynomials that are 1 at one of the places, (r, 3)."""
    powers = np.arange(1, STAGES + 1)
    values = np.linalg.solve(np.vander(_PLACES, increasing=True).T, (upper[:, None] ** powers / powers).T).T
    return np.asarray(values, dtype=np.float64)


_COEFFICIENTS = _integrals(_PLACES)
_WEIGHTS = _integrals(np.ones(1))[0]


def _t(matrix: Floats) -> Floats:
    return np.swapaxes(matrix, -1, -2)


def _one(matrix: Floats) -> Floats:
    return np.eye(matrix.shape[-1])
