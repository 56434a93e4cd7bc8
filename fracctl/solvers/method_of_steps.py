"""The method of steps: plants in state form under delayed feedback, or free."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, finite
from fracctl.controllers.adaptive_delay import AdaptiveDelayedFeedback
from fracctl.controllers.delayed_feedback import DelayedLaw, DelayedTerm
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop, Need
from fracctl.solvers.members import common_batch, positive, whole
from fracctl.solvers.method_of_steps_adaptive import AdaptiveRun
from fracctl.solvers.method_of_steps_events import first_times
from fracctl.solvers.method_of_steps_mesh import mesh_of
from fracctl.solvers.method_of_steps_runs import RenewedGain, run
from fracctl.stepwise import Steps, StepwiseTrajectory

_FEWEST = 4
_SAFE_RATIO = 63.0
"""Errors of N/2 and N steps differ by 2⁸ = 256 in the end; 2⁶ is already assumed to hold."""
_SAFE_RATIO_AT_KINKS = 1.0
"""Where a saturation sets in within a step the error is O(N⁻²) and not regular."""


class MethodOfSteps:
    """Steps of DOP853, of order 8, on a grid of each member's own that holds every breaking point.

    With one delay τ the grid repeats itself after τ: delayed stages are stages of the step N steps earlier, on its
    continuous extension of order 7, so the error is O(N⁻⁸). With several delays the extension is looked up. Events of
    the plant are found on the extension. A saturation sets in within steps, which leaves O(N⁻²): about 1e-5 with 100
    steps to an orbit and 1e-6 with 400. The error is estimated by a second run with half the steps.

    Args:
        steps: N, steps in the shortest delay, or in 2π of time where there is none; 100 serves most orbits, near passes
            and large gains want 400.
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
        if Need.FRACTIONAL_TERMS not in loop.needs:
            return None
        return f"the {self.name} solver does not take {type(loop.controller).__name__}; use 'contour'"

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
        given, n = finite("initial_state", initial_state), loop.plant.n_states
        if given.ndim not in (1, 2) or given.shape[-1] != n:
            raise ArgumentError("initial_state", f"of shape {given.shape}", f"must have shape ({n},) or (b, {n})")
        batch = common_batch(loop.batch, len(given) if given.ndim == 2 else None)
        start = np.array(np.broadcast_to(given, (batch, n)))
        problem = _Problem(loop, start, positive("horizon", horizon))
        steps, terms, events, end = problem.solved(self.steps)
        coarse, _, _, coarse_end = problem.solved(self.steps // 2)
        error = _difference(steps, coarse, np.minimum(end, coarse_end))
        error /= _SAFE_RATIO if loop.saturation is None else _SAFE_RATIO_AT_KINKS
        return StepwiseTrajectory(
            plant=loop.plant,
            steps=steps,
            terms=terms,
            saturation=loop.saturation,
            horizon=problem.horizon,
            end=end,
            events=events,
            status=problem.status(events, end, error, self.tolerance),
            error_estimate=error,
            counters={"steps": np.array([np.searchsorted(e, last) for e, last in zip(steps.edges, end, strict=True)])},
            batched=loop.batch is not None or given.ndim == 2,
        )


class _Problem:
    """A loop with its initial states and its horizon."""

    def __init__(self, loop: ClosedLoop, start: Floats, horizon: float) -> None:
        self.plant, self.saturation = loop.plant, loop.saturation
        self.start, self.horizon = start, horizon
        self.terms = tuple(term.of(len(start)) for term in loop.delayed_terms)
        self.law = law = loop.controller
        self.history = law.history if isinstance(law, DelayedLaw) else None
        self.breaks = law.history_breaks if isinstance(law, DelayedLaw) else ()

    def solved(self, count: int) -> tuple[Steps, tuple[DelayedTerm, ...], dict[str, Floats], Floats]:
        """Return the states with N = `count`, the terms with their gains, times of events, and each member's end."""
        terms = tuple(replace(t, schedule=RenewedGain(t)) if t.on_segment is not None else t for t in self.terms)
        mesh = mesh_of(self.terms, self.breaks, count, self.horizon)
        b = len(self.start)
        if len(mesh.edges) < b:
            mesh = type(mesh)(np.repeat(mesh.edges, b, axis=0), mesh.back, mesh.shares)
        events = {event.name: np.full(b, np.nan) for event in self.plant.events}
        end = np.full(b, self.horizon)
        seen = 0

        def finished(steps: Steps, taken: int) -> bool:
            nonlocal seen
            for event in self.plant.events:
                waiting = np.flatnonzero(np.isnan(events[event.name]) & (end > steps.edges[:, seen]))
                times = first_times(event, steps, seen, taken, waiting)
                new, times = waiting[times <= end[waiting]], times[times <= end[waiting]]
                events[event.name][new] = times
                if event.terminal:
                    end[new] = times
            for times in events.values():
                times[times > end] = np.nan
            broken = ~np.isfinite(steps.coefficients[taken - 1]).all(axis=(0, 2))
            for i in np.flatnonzero(broken & (end > steps.edges[:, seen])):
                bad = ~np.isfinite(steps.coefficients[seen:taken, :, i]).all(axis=(1, 2))
                end[i] = min(end[i], steps.edges[i, seen + int(np.argmax(bad))])
            seen = taken
            return bool(np.all(end <= steps.edges[:, taken]))

        with np.errstate(all="ignore"):
            if isinstance(self.law, AdaptiveDelayedFeedback):
                members = AdaptiveRun(self.plant, self.law, terms[0], self.saturation, count, self.start)
                steps = members.until(self.horizon, finished)
            else:
                steps = run(self.plant, terms, self.saturation, self.history, mesh, self.start, finished)
            if seen < len(steps.coefficients) and not np.all(end <= steps.edges[:, seen]):
                finished(steps, len(steps.coefficients))
        return steps, terms, events, end

    def status(self, events: dict[str, Floats], end: Floats, error: Floats, tolerance: float) -> Array:
        """Return a word for each member."""
        status = np.full(len(end), "ok", dtype=object)
        if tolerance > 0.0:
            status[~(error <= tolerance)] = "failed"
        status[end < self.horizon] = "diverged"
        for event in self.plant.events:
            if event.terminal:
                status[events[event.name] == end] = event.name
        return status


def _difference(fine: Steps, coarse: Steps, end: Floats) -> Floats:
    """Return the largest difference at the ends of the coarse steps over the peak of the states, (b,)."""
    times = np.minimum(coarse.edges, end[:, None])
    states = fine(times)
    gap = np.abs(states - coarse(times)).max(axis=(1, 2))
    largest: Floats = gap / np.maximum(np.abs(states).max(axis=(1, 2)), np.finfo(np.float64).tiny)
    return largest
