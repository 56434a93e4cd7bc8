"""Steps of members' own lengths, short where the motion is fast: for near passes, which even steps jump over.

A pilot run chooses its steps by DOP853's embedded error estimate, never beyond a time at which the solution is not
smooth. The run that counts takes each of them in two halves; its difference from the pilot tells its error.

Source: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, sections II.4 (choice of steps), II.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.controllers.delayed_feedback import DelayedTerm, History
from fracctl.plants.state import StatePlant
from fracctl.solvers import dop853
from fracctl.solvers.method_of_steps.events import Watch
from fracctl.solvers.method_of_steps.mesh import Mesh
from fracctl.solvers.method_of_steps.runs import by_looking_up, one_step
from fracctl.stepwise import Steps

_ALLOWED = 1e-12
"""Error of a step of the pilot over the state; its halves are 2⁸ times as accurate, as far as doubles go."""
_SMALL = 1e-3
"""Components below this share of the largest are allowed its error."""
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 5.0
"""Of the next step over the last one."""
_SHORTEST = 1e-14
"""A step over the time (or the longest step) at which a solution cannot be continued."""
_CHECK = 16
"""Steps between two questions whether anybody still has a way to go."""


def pilot(
    plant: StatePlant,
    terms: Sequence[DelayedTerm],
    history: History | None,
    breaks: Sequence[Sequence[float]],
    longest: Floats,
    start: Floats,
    most: int,
    watch: Watch,
) -> Steps:
    """Return the states of members on steps of their own choice; where a solution ends they become NaN.

    Args:
        plant: the plant.
        terms: of the control, with batch axes.
        history: states before time 0.
        breaks: for each member the times that end a step, from 0 to the horizon.
        longest: step, (b,).
        start: x(0), (b, n).
        most: steps; members that need more are left where they are.
        watch: what ends a member, and is told of the steps.
    """
    b, n = start.shape
    steps = Steps(np.full((b, most + 1), np.inf), np.empty((most, dop853.ROWS, b, n)), history)
    control = by_looking_up(terms, steps, plant.n_controls)
    ends = _columns(breaks)
    rows, x, now, h = np.arange(b), start, np.zeros(b), longest.copy()
    steps.edges[:, 0] = 0.0
    for k in range(most):
        goal = ends[rows, (ends <= now[:, None]).sum(axis=1)]
        over = (now >= watch.end) | ~np.isfinite(x).all(axis=1)
        while True:
            width, due = _fitted(h, goal - now)
            times = now + dop853.NODES[:, None] * width
            values = one_step(plant, times, width, x, control(k, times))
            after = (dop853.COMBINE[dop853.END] @ values).reshape(b, n)
            error = dop853.local_error(values, _scale(x, after))
            stuck = width < _SHORTEST * np.maximum(now, longest)
            good = (error <= 1.0) | stuck | over
            h = np.where(over, longest, np.minimum(_changed(width, error, good), longest))
            if good.all():
                break
            h = np.where(good, width, h)
        x = np.where((stuck & ~over)[:, None], np.nan, after)
        steps.coefficients[k] = (dop853.DENSE @ values).reshape(dop853.ROWS, b, n)
        now = np.where(due, goal, now + width)
        steps.edges[:, k + 1] = now
        if k % _CHECK == _CHECK - 1 and watch(steps, k + 1):
            break
    return Steps(steps.edges[:, : k + 2].copy(), steps.coefficients[: k + 1].copy(), history)


def halved(edges: Floats) -> Mesh:
    """Return a mesh with each step, between edges (b, S + 1), in two."""
    out = np.repeat(edges, 2, axis=1)[:, :-1]
    out[:, 1::2] = 0.5 * (edges[:, 1:] + edges[:, :-1])
    return Mesh(out, None, None)


def roughness(steps: Steps, members: Array) -> Floats:
    """Return for each step of some members (r,) its highest power over the state, (S, r); NaN at rest in 0."""
    rows = steps.coefficients[:, :, members]
    size = np.maximum(np.abs(rows[:, 0]).max(axis=-1), np.abs(rows[:, 0] + rows[:, 1]).max(axis=-1))
    share: Floats = np.abs(rows[:, -1]).max(axis=-1) / size
    return share


def of_members(terms: Sequence[DelayedTerm], members: Array) -> tuple[DelayedTerm, ...]:
    """Return the terms, with batch axes, of some members (r,)."""
    chosen = []
    for term in terms:
        b, *shape = term.gain.shape
        schedule = None if term.schedule is None else for_members(term.schedule, members, b, shape)
        parts = {name: getattr(term, name)[members] for name in ("gain", "delay", "recall", "switch_on")}
        chosen.append(replace(term, schedule=schedule, **parts))
    return tuple(chosen)


def for_members(
    function: Callable[[Floats], Floats], members: Array, batch: int, shape: Sequence[int]
) -> Callable[[Floats], Floats]:
    """Return a function of times (b, k) with values (b, k, …shape) as one of times of some members (r, k)."""

    def chosen(times: Floats) -> Floats:
        every = np.repeat(times[:1], batch, axis=0)
        every[members] = times
        return np.broadcast_to(function(every), (*every.shape, *shape))[members]

    return chosen


def with_own_steps(steps: Steps, members: Array, own: Steps) -> Steps:
    """Return steps of a batch where some members have those of another run; who needs fewer rests at the end."""
    count = max(len(steps.coefficients), len(own.coefficients))
    edges, coefficients = (np.array(part) for part in _lengthened(steps, count))
    edges[members], coefficients[:, :, members] = _lengthened(own, count)
    return replace(steps, edges=edges, coefficients=coefficients)


def _lengthened(steps: Steps, count: int) -> tuple[Floats, Floats]:
    """Return edges and coefficients with `count` steps."""
    more = count - len(steps.coefficients)
    if not more:
        return steps.edges, steps.coefficients
    last, width = steps.edges[:, -1:], np.diff(steps.edges[:, -2:], axis=1)
    rest = np.zeros((more, *steps.coefficients.shape[1:]))
    rest[:, 0] = steps.coefficients[-1, :2].sum(axis=0)
    edges = np.concatenate([steps.edges, last + width * np.arange(1, more + 1)], axis=1)
    return edges, np.concatenate([steps.coefficients, rest])


def _columns(breaks: Sequence[Sequence[float]]) -> Floats:
    """Return the breaks of all members with infinity behind the last, (b, c)."""
    out = np.full((len(breaks), 1 + max(map(len, breaks))), np.inf)
    for row, times in zip(out, breaks, strict=True):
        row[: len(times)] = times
    return out


def _fitted(h: Floats, room: Floats) -> tuple[Floats, Booleans]:
    """Return steps that end at the break or leave as much again before it, and whether they end there."""
    due = h >= room * (1.0 - 1e-12)
    return np.where(due, room, np.where(h > 0.5 * room, 0.5 * room, h)), due


def _scale(x: Floats, after: Floats) -> Floats:
    """Return the error allowed in each component, (b, n)."""
    size = np.maximum(np.abs(x), np.abs(after))
    scale: Floats = _ALLOWED * (size + _SMALL * size.max(axis=1, keepdims=True)) + np.finfo(np.float64).tiny
    return scale


def _changed(width: Floats, error: Floats, good: Booleans) -> Floats:
    """Return the steps to try next after steps with an error over what is allowed."""
    factor = _SAFETY * np.maximum(error, 1e-16) ** (-1.0 / dop853.ORDER)
    factor = np.where(np.isfinite(factor), factor, _LEAST)
    return width * np.clip(factor, _LEAST, np.where(good, _MOST, 1.0))
