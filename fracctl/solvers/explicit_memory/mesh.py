"""Steps that grow from where powers of time begin, and where demands and events cross zero on them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.fractional.collocation import chebyshev_nodes

_AFTER_A_KINK = 2.0**-8
"""First step after a kink over the even steps; the powers there are higher by two than at time 0."""
_APART = 1e-8
"""Of the horizon: breaks that are nearer to each other are one; what a misplaced kink does goes with the square."""
_HALVINGS = 50


def step_edges(horizon: float, count: int, first: float, breaks: Floats, powers: bool) -> Floats:
    """Return the ends of steps from 0 to the horizon, with all breaks among them.

    Args:
        horizon: S.
        count: number of even steps.
        first: the first step, from which on steps double up to the even ones.
        breaks: times in (0, S), in any order.
        powers: whether there are powers of time after 0 and after breaks; steps do not grow where there are none.
    """
    even = horizon / count
    edges, start = [np.zeros(1)], 0.0
    for end in [*np.sort(breaks[(breaks > 0.0) & (breaks < horizon)]), horizon]:
        if end - start > _APART * horizon:
            cells = start + (end - start) * np.linspace(0.0, 1.0, 1 + _at_least(1, (end - start) / even))
            if powers:
                smallest = first if start == 0.0 else _AFTER_A_KINK * even
                halvings = _at_least(0, np.log2((cells[1] - start) / smallest))
                edges.append(start + (cells[1] - start) * 0.5 ** np.arange(halvings, 0, -1))
            edges.append(cells[1:])
            start = end
    steps = np.concatenate(edges)
    steps[-1] = horizon
    return steps


def _at_least(least: int, number: float) -> int:
    return max(int(np.ceil(number - 1e-9)), least)


def crossings(
    values: Floats, edges: Floats, function: Callable[[Array, Floats, Floats], Floats], signs: Floats
) -> tuple[Array, Floats]:
    """Return where functions of polynomials on steps change their signs: members (r,) and times (r,).

    Args:
        values: at the nodes, (b, c, P, K).
        edges: of the P steps.
        function: of members (r,), times (r,) and values (r, c), returns (r, g).
        signs: its values at the nodes, (b, g, P, K).
    """
    nodes = chebyshev_nodes(values.shape[-1])
    with np.errstate(invalid="ignore"):
        changed = (signs[..., 1:] < 0.0) != (signs[..., :-1] < 0.0)
    changed &= np.isfinite(signs[..., 1:]) & np.isfinite(signs[..., :-1])
    members, which, steps, places = np.nonzero(changed)
    low, high = nodes.t[places], nodes.t[places + 1]
    start, width = edges[steps], np.diff(edges)[steps]
    pieces, rows = values[members, :, steps], np.arange(len(members))
    falling = signs[members, which, steps, places] >= 0.0
    for _ in range(_HALVINGS if len(members) else 0):
        middle = 0.5 * (low + high)
        at = np.einsum("rck,rk->rc", pieces, nodes.interpolation(middle))
        before = (function(members, start + width * middle, at)[rows, which] >= 0.0) == falling
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return members, start + width * high
