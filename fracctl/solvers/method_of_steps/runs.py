"""The steps themselves: all members of a batch take theirs together."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from fracctl.arrays import Booleans, Floats
from fracctl.compiling import compiled
from fracctl.controllers.delayed_feedback import DelayedTerm, GainFunction, History, Window
from fracctl.controllers.saturation import Saturation
from fracctl.plants.state import StatePlant
from fracctl.solvers import dop853
from fracctl.solvers.method_of_steps.mesh import Mesh
from fracctl.stepwise import Steps

Control = Callable[[int, Floats], Floats]
"""Takes the index of a stage and its states (b, n) and returns the controls (b, m)."""
_CHECK = 64
"""Steps between two questions whether anybody still has a way to go."""


def run(
    plant: StatePlant,
    terms: Sequence[DelayedTerm],
    saturation: Saturation | None,
    history: History | None,
    mesh: Mesh,
    start: Floats,
    finished: Callable[[Steps, int], bool],
) -> Steps:
    """Return the states of all members on a mesh.

    Args:
        plant: the plant.
        terms: of the control, with batch axes.
        saturation: of the control.
        history: states before time 0.
        mesh: of b members.
        start: x(0), (b, n).
        finished: asked now and then, with the states so far and the number of steps taken; True ends the run.
    """
    b, n = start.shape
    count = mesh.edges.shape[1] - 1
    steps = Steps(mesh.edges, np.full((count, dop853.ROWS, b, n), np.nan), history)
    on_grid = mesh.back is not None
    control = _on_the_grid(plant, terms, mesh, steps) if on_grid else by_looking_up(terms, steps, plant.n_controls)
    x, widths = start, np.diff(mesh.edges, axis=1)
    for k in range(count):
        h = np.ascontiguousarray(widths[:, k])
        times = mesh.edges[:, k] + dop853.NODES[:, None] * h
        values = one_step(plant, times, h, x, _limited(saturation, control(k, times)))
        steps.coefficients[k] = (dop853.DENSE @ values).reshape(dop853.ROWS, b, n)
        x = (dop853.COMBINE[dop853.END] @ values).reshape(b, n)
        if k % _CHECK == _CHECK - 1 and finished(steps, k + 1):
            break
    return steps


def one_step(plant: StatePlant, times: Floats, h: Floats, x: Floats, control: Control) -> Floats:
    """Return Y = [x, h k_1, …, h k_16] of one step, (17, b n)."""
    values = np.empty((dop853.STAGES + 1, x.size))
    values[0] = x.ravel()
    for s in range(dop853.STAGES):
        state = (dop853.COMBINE[s, : s + 1] @ values[: s + 1]).reshape(x.shape)
        rates = plant.rates(times[s], state, control(s, state))
        np.multiply(h[:, None], rates, out=values[s + 1].reshape(x.shape))
    return values


def _limited(saturation: Saturation | None, demand: Control) -> Control:
    return demand if saturation is None else lambda s, x: saturation(demand(s, x))


def _inside(times: Floats) -> Floats:
    """Return the times of the stages of a step (16, b), those at its ends on the inner side of jumps there."""
    inset = 8e-15 * np.abs(times[dop853.END])
    return np.clip(times, times[0] + inset, times[dop853.END] - inset)


def _feedback(term: DelayedTerm, on: Booleans, times: Floats, reference: Floats) -> Control:
    """Return -K (x - W) with W (16, b, n) at times (16, b), and nothing for members that are not on."""
    if term.schedule is None:
        gain = term.gain if on.all() else term.gain * on[:, None, None]
        return lambda s, x: _fed_back(gain, reference[s], x)
    gains = np.array(np.swapaxes(term.gains(_inside(times).T), 0, 1), order="C")
    gains[:, ~on] = 0.0
    return lambda s, x: _fed_back(gains[s], reference[s], x)


@compiled
def _fed_back(gain: Floats, reference: Floats, x: Floats) -> Floats:
    members, controls, states = gain.shape
    out = np.zeros((members, controls))
    for b in range(members):
        for i in range(controls):
            for j in range(states):
                out[b, i] -= gain[b, i, j] * (x[b, j] - reference[b, j])
    return out


class RenewedGain:
    """The K(t) that a law has given for each delay of a run, (b, k, m, n) at times (b, k); 0 before the first.

    Args:
        term: of the control, with batch axes.
    """

    def __init__(self, term: DelayedTerm) -> None:
        self._delay, self._shape = term.delay, term.gain.shape[-2:]
        self._parts: dict[int, GainFunction] = {}

    def renew(self, segment: int, gain: GainFunction) -> None:
        """Take a K(t) for the times from `segment` delays on."""
        self._parts[segment] = gain

    def __call__(self, times: Floats) -> Floats:
        """Return the gains at times (b, k)."""
        out = np.zeros((*times.shape, *self._shape))
        segments = np.floor(times / self._delay[:, None] * (1.0 + 4e-16)).astype(int)
        for segment in set(np.unique(segments)) & self._parts.keys():
            inside = segments == segment
            columns = np.flatnonzero(inside.any(axis=0))
            out[inside] = self._parts[segment](times[:, columns])[inside[:, columns]]
        return out


def _renewals(plant: StatePlant, term: DelayedTerm, on: Booleans, back: int, steps: Steps) -> Callable[[int], None]:
    """Return what asks a law for its next K(t) where a delay has ended."""

    def renew(k: int) -> None:
        if term.on_segment is None or k % back or k < back or not on[k : k + back].any():
            return
        assert isinstance(term.schedule, RenewedGain)
        start = np.ascontiguousarray(steps.edges[:, k - back])
        term.schedule.renew(k // back, term.on_segment(Window(plant, start, term.delay, steps)))

    return renew


def _on_the_grid(
    plant: StatePlant, terms: Sequence[DelayedTerm], mesh: Mesh, steps: Steps
) -> Callable[[int, Floats], Control]:
    """The one delay is a whole number of steps: the reference is the polynomial so many steps back."""
    (term,), back = terms, mesh.back
    assert back is not None
    assert mesh.shares is not None
    _, rows, b, n = steps.coefficients.shape
    middles = 0.5 * (mesh.edges[:, 1:] + mesh.edges[:, :-1])
    on = (middles > term.switch_on[:, None]).T
    recall = term.recall[:, None]
    renew = _renewals(plant, term, on, back, steps)
    free = np.zeros((b, term.gain.shape[1]))
    earlier: deque[Floats] = deque(_fitted(term, mesh.shares, steps.history, n), maxlen=back)

    def control(k: int, times: Floats) -> Control:
        renew(k)
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
        delayed = (dop853.AT_STAGES @ reference.reshape(rows, -1)).reshape(-1, b, n)
        return _feedback(term, on[k], times, delayed)

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


def by_looking_up(terms: Sequence[DelayedTerm], steps: Steps, n_controls: int) -> Callable[[int, Floats], Control]:
    """Delayed times lie anywhere: the reference is evaluated at all stages of a step."""
    free = np.zeros((steps.coefficients.shape[2], n_controls))

    def control(_: int, times: Floats) -> Control:
        parts = []
        inside, middle = _inside(times).T, 0.5 * (times[0] + times[dop853.END])
        for term in terms:
            known = middle > (0.0 if steps.history is not None else term.delay)
            on = known & (middle > term.switch_on)
            if on.any():
                reference = np.ascontiguousarray(np.swapaxes(steps.reference(term, inside), 0, 1))
                reference[:, ~on] = 0.0
                parts.append(_feedback(term, on, times, reference))
        return lambda s, x: sum((part(s, x) for part in parts), free)

    return control
