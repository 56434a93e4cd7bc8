"""The steps themselves: all members of a batch take theirs together."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from fracctl.arrays import Floats
from fracctl.compiling import compiled
from fracctl.controllers.delayed_feedback import DelayedTerm, History
from fracctl.plants.state import StatePlant
from fracctl.solvers import dop853
from fracctl.solvers.method_of_steps_mesh import Mesh
from fracctl.stepwise import Steps

Control = Callable[[int, Floats], Floats]
"""Takes the index of a stage and its states (b, n) and returns the controls (b, m)."""
_CHECK = 64
"""Steps between two questions whether anybody still has a way to go."""


def run(
    plant: StatePlant,
    terms: Sequence[DelayedTerm],
    history: History | None,
    mesh: Mesh,
    start: Floats,
    finished: Callable[[Steps, int], bool],
) -> Steps:
    """Return the states of all members on a mesh.

    Args:
        plant: the plant.
        terms: of the control, with batch axes.
        history: states before time 0.
        mesh: of b members.
        start: x(0), (b, n).
        finished: asked now and then, with the states so far and the number of steps taken; True ends the run.
    """
    b, n = start.shape
    count = mesh.edges.shape[1] - 1
    steps = Steps(mesh.edges, np.full((count, dop853.ROWS, b, n), np.nan), history)
    control = _on_the_grid(terms, mesh, steps) if mesh.back else _by_looking_up(terms, steps, plant.n_controls)
    x, widths = start, np.diff(mesh.edges, axis=1)
    for k in range(count):
        h = np.ascontiguousarray(widths[:, k])
        times = mesh.edges[:, k] + dop853.NODES[:, None] * h
        values = _step(plant, times, h, x, control(k, times))
        steps.coefficients[k] = (dop853.DENSE @ values).reshape(dop853.ROWS, b, n)
        x = (dop853.COMBINE[dop853.END] @ values).reshape(b, n)
        if k % _CHECK == _CHECK - 1 and finished(steps, k + 1):
            break
    return steps


def _step(plant: StatePlant, times: Floats, h: Floats, x: Floats, control: Control) -> Floats:
    """Return Y = [x, h k_1, …, h k_16] of one step, (17, b n)."""
    values = np.empty((dop853.STAGES + 1, x.size))
    values[0] = x.ravel()
    for s in range(dop853.STAGES):
        state = (dop853.COMBINE[s, : s + 1] @ values[: s + 1]).reshape(x.shape)
        rates = plant.rates(times[s], state, control(s, state))
        np.multiply(h[:, None], rates, out=values[s + 1].reshape(x.shape))
    return values


def _feedback(gain: Floats, reference: Floats) -> Control:
    """Return -K (x - W) with K (b, m, n) and W (16, b, n)."""
    return lambda s, x: _fed_back(gain, reference[s], x)


@compiled
def _fed_back(gain: Floats, reference: Floats, x: Floats) -> Floats:
    members, controls, states = gain.shape
    out = np.zeros((members, controls))
    for b in range(members):
        for i in range(controls):
            for j in range(states):
                out[b, i] -= gain[b, i, j] * (x[b, j] - reference[b, j])
    return out


def _on_the_grid(terms: Sequence[DelayedTerm], mesh: Mesh, steps: Steps) -> Callable[[int, Floats], Control]:
    """The one delay is a whole number of steps: the reference is the polynomial so many steps back."""
    (term,), back = terms, mesh.back
    assert back is not None
    assert mesh.shares is not None
    _, rows, b, n = steps.coefficients.shape
    middles = 0.5 * (mesh.edges[:, 1:] + mesh.edges[:, :-1])
    on = (middles > term.switch_on[:, None]).T
    recall = term.recall[:, None]
    free = np.zeros((b, term.gain.shape[1]))
    earlier: deque[Floats] = deque(_fitted(term, mesh.shares, steps.history, n), maxlen=back)

    def control(k: int, _: Floats) -> Control:
        if k < back and steps.history is None:
            return lambda s, x: free  # noqa: ARG005
        if k < back:
            reference = earlier[k]
        else:
            reference = steps.coefficients[k - back]
            if recall.any():
                before = earlier[0] if steps.history is not None or k >= 2 * back else reference
                reference = (1.0 - recall) * reference + recall * before
                earlier.append(reference)
        if not on[k].any():
            return lambda s, x: free  # noqa: ARG005
        gain = term.gain if on[k].all() else term.gain * on[k][:, None, None]
        return _feedback(gain, (dop853.AT_STAGES @ reference.reshape(rows, -1)).reshape(-1, b, n))

    return control


def _fitted(term: DelayedTerm, shares: Floats, history: History | None, n: int) -> list[Floats]:
    """Return the polynomials of the history on the steps of one delay, each (8, b, n); none without a history."""
    if history is None:
        return []
    starts, widths = shares[:, :-1, None] - 1.0, np.diff(shares, axis=1)[..., None]
    times = term.delay[:, None, None] * (starts + widths * _INSIDE)
    b, back, rows = times.shape
    values = np.broadcast_to(history(times.reshape(b, -1)), (b, back * rows, n)).reshape(b, back, rows, n)
    return list(np.einsum("rq,bkqn->krbn", dop853.FIT, values))


_INSIDE: Floats = np.clip(dop853.SAMPLES, 1e-14, 1.0 - 1e-14)
"""A history that jumps at the end of a step is asked on this side of it."""


def _by_looking_up(terms: Sequence[DelayedTerm], steps: Steps, n_controls: int) -> Callable[[int, Floats], Control]:
    """Delayed times lie anywhere: the reference is evaluated at all stages of a step."""
    middles = 0.5 * (steps.edges[:, 1:] + steps.edges[:, :-1])
    free = np.zeros((steps.coefficients.shape[2], n_controls))

    def control(k: int, times: Floats) -> Control:
        parts = []
        inset = 1e-15 * np.abs(times[dop853.END]) * 8.0
        inside = np.clip(times, times[0] + inset, times[dop853.END] - inset).T
        for term in terms:
            known = middles[:, k] > (0.0 if steps.history is not None else term.delay)
            on = known & (middles[:, k] > term.switch_on)
            if on.any():
                reference = np.ascontiguousarray(np.swapaxes(steps.reference(term, inside), 0, 1))
                reference[:, ~on] = 0.0
                parts.append(_feedback(term.gain * on[:, None, None], reference))
        return lambda s, x: sum((part(s, x) for part in parts), free)

    return control
