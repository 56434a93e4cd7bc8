"""The method of steps: plants in state form under delayed feedback, or free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Booleans, Floats, positive
from fracctl.controllers.adaptive_delay import AdaptiveDelayedFeedback
from fracctl.controllers.delayed_feedback import DelayedLaw, DelayedTerm
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop, Need
from fracctl.plants.capabilities import members_of
from fracctl.plants.function import FunctionPlant
from fracctl.solvers.control_events import ended_by_controls
from fracctl.solvers.members import starting_states, whole
from fracctl.solvers.method_of_steps.adaptive import AdaptiveRun
from fracctl.solvers.method_of_steps.events import Watch
from fracctl.solvers.method_of_steps.mesh import breaks_of, mesh_of
from fracctl.solvers.method_of_steps.refinement import (
    for_members,
    halved,
    of_members,
    pilot,
    roughness,
    with_own_steps,
)
from fracctl.solvers.method_of_steps.runs import RenewedGain, run
from fracctl.stepwise import Steps, StepwiseTrajectory

_FEWEST = 4
_SAFE_RATIO = 63.0
"""Errors of N/2 and N steps differ by 2⁸ = 256 in the end where all is smooth; 2⁶ is already assumed to hold."""
_SAFE_RATIO_AT_KINKS = 1.0
"""Where a saturation sets in within a step the error is O(N⁻²) and not regular."""
_SAFE_RATIO_AT_JUMPS = 0.25
"""Where the plant itself may jump within a step, errors of N/2 and N steps can be alike, and their difference small."""
_GOAL = 1e-6
"""Errors above it, or above the tolerance, are worth steps of a member's own."""
_SMOOTH, _JUMP = 1e-7, 0.1
"""Shares of the state that the highest power of a step makes out: below, shorter steps gain nothing, since errors come
from the growth of rounding; above, even of the largest state, the step has jumped over what happens in it."""
_ROOM = 5000
"""A member gets so many steps of its own, and four times as many as it had; who needs more keeps the even ones."""
_DOUBTFUL = 1e-3
"""Above this error a step with such a jump is not believed."""


class MethodOfSteps:
    """Steps of DOP853, of order 8, on a grid of each member's own that holds every breaking point.

    With one delay τ the grid repeats itself after τ: delayed stages are stages of the step N steps earlier, on its
    continuous extension of order 7, so the error is O(N⁻⁸). With several delays the extension is looked up. Events of
    the plant are found on the extension. A saturation sets in within steps, which leaves O(N⁻²): about 1e-5 with 100
    steps to an orbit and 1e-6 with 400. The error is estimated by a second run with half the steps: from their
    difference, divided by 2⁶ where the plant is smooth and nothing saturates, and times 4 for a `FunctionPlant` that
    does not say that it is smooth.

    A member whose error is above 1e-6, or above the tolerance, because the motion is fast somewhere (a near pass) is
    computed again with steps of its own, chosen by the error of each; the others keep theirs. Not so under a
    saturation, renewed gains or an adaptive delay: there a member ends as ``diverged`` before a step that jumped over
    something.

    Args:
        steps: N, steps in the shortest delay, or in 2π of time where there is none; 100 serves most orbits.
        tolerance: error estimate, relative to the peak of the states, above which a member is ``failed``; 0 accepts any
            (the transients of chaotic plants cannot be computed to the end by anybody).

    Raises:
        ArgumentError: a number is out of its range.
    """

    name = "method_of_steps"
    cross_check = 0.0
    checked_by = "contour"

    def __init__(self, steps: int = 100, tolerance: float = 0.0) -> None:
        self.steps = whole("steps", steps, 2 * _FEWEST, 100_000)
        if not 0.0 <= tolerance < 1.0:
            raise ArgumentError("tolerance", tolerance, "must lie in [0, 1)")
        self.tolerance = float(tolerance)

    def supports(self, loop: ClosedLoop) -> str | None:
        """Return None for delayed feedback and free motion, otherwise why it is refused and what to use instead."""
        if len(loop.delayed_terms) > 1 and any(term.on_segment is not None for term in loop.delayed_terms):
            return f"the {self.name} solver renews gains with one delay only; use one law"
        if len(loop.delayed_terms) > 1 and any(term.adapts for term in loop.delayed_terms):
            return f"the {self.name} solver adapts a delay that stands alone; use one law"
        if Need.NONLINEAR_LAW in loop.needs:
            use = "implicit_memory"
        elif Need.FRACTIONAL_TERMS in loop.needs:
            use = "contour" if loop.needs == {Need.FRACTIONAL_TERMS} else "explicit_memory"
        else:
            return None
        return f"the {self.name} solver does not take {type(loop.controller).__name__}; use '{use}'"

    def solve(self, loop: ClosedLoop, initial_state: ArrayLike, horizon: float) -> StepwiseTrajectory:
        """Return the trajectories of all members.

        Args:
            loop: the closed loop, of b members or a single one.
            initial_state: x(0), (n,), or (b, n) one a member.
            horizon: S > 0, the last time.

        Raises:
            ArgumentError: a shape does not fit, or the horizon is not positive.
            UnsupportedError: the law is another than delayed feedback.
        """
        if refusal := self.supports(loop):
            raise UnsupportedError(refusal)
        start, batched = starting_states(loop, initial_state)
        problem = _Problem(loop, start, positive("horizon", horizon), self.steps)
        with np.errstate(all="ignore"):
            steps, terms, watch, error = problem.solved()
            steps, error = problem.refined(steps, watch, error, min(self.tolerance or _GOAL, _GOAL))
            problem.withdraw_doubtful(steps, watch, error)
        end = watch.end
        trajectory = StepwiseTrajectory(
            plant=loop.plant,
            steps=steps,
            terms=terms,
            saturation=loop.saturation,
            horizon=problem.horizon,
            end=end,
            events=watch.times,
            status=problem.status(watch, error, self.tolerance),
            error_estimate=error,
            counters={"steps": np.array([np.searchsorted(e, last) for e, last in zip(steps.edges, end, strict=True)])},
            batched=batched,
        )
        return ended_by_controls(loop.plant, trajectory)


class _Problem:
    """A loop with its initial states, its horizon and N."""

    def __init__(self, loop: ClosedLoop, start: Floats, horizon: float, count: int) -> None:
        self.plant, self.saturation = loop.plant, loop.saturation
        self.ratio = _SAFE_RATIO if loop.saturation is None else _SAFE_RATIO_AT_KINKS
        if isinstance(loop.plant, FunctionPlant) and not loop.plant.smooth:
            self.ratio = _SAFE_RATIO_AT_JUMPS
        self.start, self.horizon, self.count = start, horizon, count
        self.terms = tuple(term.of(len(start)) for term in loop.delayed_terms)
        self.law = law = loop.controller
        self.history = law.history if isinstance(law, DelayedLaw) else None
        self.breaks = law.history_breaks if isinstance(law, DelayedLaw) else ()

    def solved(self) -> tuple[Steps, tuple[DelayedTerm, ...], Watch, Floats]:
        """Return the states on even steps, the terms with their gains, what ended members, and estimated errors."""
        watch = Watch(self.plant.events, np.full(len(self.start), self.horizon))
        steps, terms = self._on_even_steps(self.count, watch)
        coarse, _ = self._on_even_steps(self.count // 2, Watch((), watch.end))
        error = _difference(steps, coarse, watch.end, self.horizon)
        return steps, terms, watch, error / self.ratio

    def _on_even_steps(self, count: int, watch: Watch) -> tuple[Steps, tuple[DelayedTerm, ...]]:
        terms = tuple(replace(t, schedule=RenewedGain(t)) if t.on_segment is not None else t for t in self.terms)
        if isinstance(self.law, AdaptiveDelayedFeedback):
            members = AdaptiveRun(self.plant, self.law, terms[0], self.saturation, count, self.start)
            steps = members.until(self.horizon, watch)
        else:
            mesh = mesh_of(self.terms, self.breaks, count, self.horizon)
            b = len(self.start)
            if len(mesh.edges) < b:
                mesh = type(mesh)(np.repeat(mesh.edges, b, axis=0), mesh.back, mesh.shares)
            steps = run(self.plant, terms, self.saturation, self.history, mesh, self.start, watch)
        watch.look_at_rest(steps)
        return steps, terms

    def refined(self, steps: Steps, watch: Watch, error: Floats, goal: float) -> tuple[Steps, Floats]:
        """Return states and errors where members that rough steps keep from a goal have steps of their own."""
        renewed = any(term.on_segment is not None for term in self.terms)
        if renewed or self.saturation is not None or isinstance(self.law, AdaptiveDelayedFeedback):
            return steps, error
        missed = np.flatnonzero(~(error <= goal) | watch.diverged(self.horizon))
        rough = _begun(steps, watch, missed) & (roughness(steps, missed) > _SMOOTH)
        members = missed[rough.any(axis=0) | watch.diverged(self.horizon)[missed]]
        if not members.size:
            return steps, error
        own, found, own_error = self._on_own_steps(members, _ROOM + 4 * len(steps.coefficients))
        done = np.flatnonzero(own.edges[:, -1] >= found.end)
        watch.take(members[done], found, done)
        error[members[done]] = own_error[done]
        own = Steps(own.edges[done], own.coefficients[:, :, done], None)
        return with_own_steps(steps, members[done], own), error

    def _on_own_steps(self, members: Array, most: int) -> tuple[Steps, Watch, Floats]:
        """Return states, what ended members, and estimated errors of some members on steps of their own."""
        terms, start, b = of_members(self.terms, members), self.start[members], len(self.start)
        plant = members_of(self.plant, members)
        history = self.history and for_members(self.history, members, b, start.shape[1:])
        breaks = [breaks_of(terms, self.breaks, i, self.horizon) for i in range(len(members))]
        shortest = np.min([term.delay for term in terms], axis=0) if terms else np.full(len(members), 2.0 * np.pi)
        latest = np.full(len(members), self.horizon)
        first = Watch(self.plant.events, latest)
        rough = pilot(plant, terms, history, breaks, shortest / (self.count // 2), start, most, first)
        first.look_at_rest(rough)
        watch = Watch(self.plant.events, np.where(first.diverged(self.horizon), first.end, latest))
        steps = run(plant, terms, None, history, halved(rough.edges), start, watch)
        watch.look_at_rest(steps)
        return steps, watch, _difference(steps, rough, watch.end, self.horizon) / self.ratio

    def withdraw_doubtful(self, steps: Steps, watch: Watch, error: Floats) -> None:
        """End inaccurate members before a step whose highest power is of the order of the largest state."""
        members = np.flatnonzero(~(error <= _DOUBTFUL))
        rows, begun = steps.coefficients[:, :, members], _begun(steps, watch, members)
        peak = np.where(begun, np.abs(rows[:, 0]).max(axis=-1), 0.0).max(axis=0)
        jumps = begun & (np.abs(rows[:, -1]).max(axis=-1) > _JUMP * peak)
        for member, steps_of_it in zip(members, jumps.T, strict=True):
            if steps_of_it.any():
                watch.stop(int(member), steps.edges[member, int(np.argmax(steps_of_it))])

    def status(self, watch: Watch, error: Floats, tolerance: float) -> Array:
        """Return a word for each member."""
        status = np.full(len(error), "ok", dtype=object)
        for event in self.plant.events:
            if event.terminal:
                status[watch.times[event.name] == watch.end] = event.name
        if tolerance > 0.0:
            status[~(error <= tolerance)] = "failed"
        status[watch.diverged(self.horizon)] = "diverged"
        return status


def _begun(steps: Steps, watch: Watch, members: Array) -> Booleans:
    """Return which steps some members (r,) begin before they end, (S, r)."""
    begun: Booleans = watch.end[members] > steps.edges[members, :-1].T
    return begun


def _difference(fine: Steps, coarse: Steps, end: Floats, horizon: float) -> Floats:
    """Return the largest difference at the ends of the coarse steps over the peak of the states, (b,)."""
    last = np.where(end < horizon, np.nextafter(end, 0.0), end)
    times = np.minimum(coarse.edges, last[:, None])
    states = fine(times)
    gap = np.abs(states - coarse(times)).max(axis=(1, 2))
    largest: Floats = gap / np.maximum(np.abs(states).max(axis=(1, 2)), np.finfo(np.float64).tiny)
    return np.where(np.isnan(largest), np.inf, largest)
