"""Implicit steps for stiff plants under laws with a fractional memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats, positive
from fracctl.controllers.delayed_feedback import DelayedLaw
from fracctl.controllers.memory import MemoryLaw
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.sum_of_exponentials import sum_of_exponentials
from fracctl.loop import ClosedLoop
from fracctl.meshwise import MeshTrajectory
from fracctl.plants.capabilities import CompiledPlant
from fracctl.plants.state import Event, StatePlant
from fracctl.solvers.control_events import ended_by_controls
from fracctl.solvers.implicit_memory.equations import Given
from fracctl.solvers.implicit_memory.kernel import BRACKETED, UNRESOLVED, Path, march, room_for
from fracctl.solvers.members import starting_states

_GROWTH = 15.0
"""Share by which the first steps grow, over the largest step: 3 % for 2e-3, so that they are refined as the others."""
_RUNG = 1.2
"""Ratio of neighbouring lengths of steps."""
_LOG_RUNG = float(np.log(_RUNG))
_MOST_GROWTH = 0.3
"""Far below √2, where BDF2 with growing steps ends to be stable."""
_PILOT, _FIRST = 2.0, 1e-5
"""Steps of the run that tells where shorter and longer ones will do, over those of the coarse run; its first one."""
_NEAR, _SHORTEST, _LONGEST = 4, 1.0 / 8.0, 10.0
"""Steps of it to both sides that must be smooth too, and by what steps may be longer at most."""
_BISECTIONS = 60


class ImplicitMemory:
    """BDF2 on a graded mesh, the memory as a sum of exponentials.

    The first steps grow from `first_step`, by 15 times `step` each: a torque on a short tether and a
    derivative of Riemann and Liouville are both singular at the start. Each step solves for the m rates at its end by
    Newton's method with differences, whose derivatives are kept as long as they serve, and where that does not converge
    (a control that jumps to the other limit) by bracketing one row after the other, each of which grows with its own
    rate. The derivative D^ν is that of rates linear in each step: exact in the step itself, by decaying modes before.
    Error O(step²), away from kinks of the limits. Where no limit holds a derivative of Riemann and Liouville of order ν
    back, rates err by O(first_step^(1-ν)) too, which for orders above 0.6 asks for a much shorter first step (1e-28 for
    0.8) and is more than the error estimate tells.

    A pilot run tells where the motion is smooth, for steps of up to 10 times `step`, and where it bends or a control
    comes to a limit, for an eighth of it. The run is then made twice, on that mesh and with each of its steps halved;
    the second is returned, and the difference is its error estimate, three times too large where the error is regular.

    Args:
        step: step of the coarse run, in the plant's time, where the motion bends as the unit of rates in that of time.
        first_step: first one.
        memory_tolerance: largest relative error of the kernel of the memory.
        tolerance: error estimate above which a member is ``failed``; 0 accepts any.

    Raises:
        ArgumentError: a number is out of its range.
    """

    name = "implicit_memory"
    cross_check = 0.0
    checked_by = "contour"

    def __init__(
        self,
        step: float = 4e-3,
        first_step: float = 1e-9,
        memory_tolerance: float = 1e-8,
        tolerance: float = 0.0,
    ) -> None:
        self.step, self.first_step = positive("step", step), positive("first_step", first_step)
        if self.first_step > self.step:
            raise ArgumentError("first_step", first_step, f"must not be above `step`, {step:g}")
        if not 1e-13 <= memory_tolerance <= 0.1:
            raise ArgumentError("memory_tolerance", memory_tolerance, "must lie in [1e-13, 0.1]")
        if not 0.0 <= tolerance < 1.0:
            raise ArgumentError("tolerance", tolerance, "must lie in [0, 1)")
        self.memory_tolerance, self.tolerance = float(memory_tolerance), float(tolerance)

    def supports(self, loop: ClosedLoop) -> str | None:
        """Return None for laws with a memory in the loop, otherwise why it is refused and what to use instead."""
        if not isinstance(loop.controller, MemoryLaw):
            law = "free motion" if loop.controller is None else type(loop.controller).__name__
            delayed = loop.controller is None or isinstance(loop.controller, DelayedLaw)
            instead = "method_of_steps" if delayed else "explicit_memory"
            return f"the {self.name} solver does not take {law}; use '{instead}'"
        if not isinstance(loop.plant, CompiledPlant):
            return f"the {self.name} solver needs a plant with a compiled acceleration, as Tether has"
        if loop.saturation is not None and loop.saturation.by != "axis":
            return f"the {self.name} solver limits each control by itself; use a saturation by axis"
        return None

    def solve(self, loop: ClosedLoop, initial_state: ArrayLike, horizon: float) -> MeshTrajectory:
        """Return the trajectories of all members.

        Args:
            loop: the closed loop, of b members or a single one.
            initial_state: [q(0), q'(0)], (n,), or (b, n) one a member.
            horizon: S > 0, the last time.

        Raises:
            ArgumentError: a shape does not fit, or the horizon is not positive.
            UnsupportedError: the solver does not take the loop.
        """
        if refusal := self.supports(loop):
            raise UnsupportedError(refusal)
        start, batched = starting_states(loop, initial_state)
        horizon = positive("horizon", horizon)
        problem = _Problem(loop, start, self.memory_tolerance)
        with np.errstate(all="ignore"):
            pilot = problem.on(graded_mesh(max(self.first_step, _FIRST), _PILOT * self.step, horizon))
            mesh = graded_mesh(self.first_step, self.step, horizon, _smooth(pilot))
            coarse, fine = problem.on(mesh), problem.on(halved(mesh))
        return self._trajectory(loop, coarse, fine, batched)

    def _trajectory(self, loop: ClosedLoop, coarse: _Run, fine: _Run, batched: bool) -> MeshTrajectory:
        end, events, ended = _ends(loop.plant, fine)
        error = _difference(coarse, fine, end)
        taken = fine.times[1:] <= end[:, None]
        status = np.where(ended == "", "ok", ended).astype(object)
        unresolved = ((fine.how == UNRESOLVED) & taken).sum(axis=1)
        status[unresolved > 0] = "failed"
        if self.tolerance:
            status[~(error <= self.tolerance)] = "failed"
        status[(fine.steps < len(fine.times) - 1) & (ended == "")] = "diverged"
        assert isinstance(loop.controller, MemoryLaw)
        trajectory = MeshTrajectory(
            plant=loop.plant,
            law=loop.controller,
            times=fine.times,
            on_mesh=fine.states,
            demands=fine.demands,
            memory=fine.memory,
            auxiliary=fine.auxiliary,
            limits=fine.limits,
            end=end,
            events=events,
            status=status,
            error_estimate=error,
            memory_error=fine.memory_error,
            counters={
                "steps": taken.sum(axis=1),
                "iterations": np.where(taken, fine.iterations, 0).sum(axis=1),
                "bracketed": ((fine.how == BRACKETED) & taken).sum(axis=1),
                "unresolved": unresolved,
            },
            batched=batched,
        )
        return ended_by_controls(loop.plant, trajectory)


def graded_mesh(first: float, largest: float, horizon: float, longer: tuple[Floats, Floats] | None = None) -> Floats:
    """Return times from 0 to the horizon: steps that grow, a fifth after some equal ones, up to `largest`.

    Equal steps share what a step is made of, so few lengths are used.

    Args:
        first: the first step.
        largest: the last one.
        horizon: the last time.
        longer: by what the largest step may be longer from given times on, (k,) each.
    """
    equal = max(1, round(np.log(_RUNG) / min(_GROWTH * largest, _MOST_GROWTH)))
    since, stretch = (longer[0].tolist(), longer[1].tolist()) if longer else ([0.0], [1.0])
    lowest = -int(np.ceil(np.log(largest / min(first, horizon)) / np.log(_RUNG)))
    times, t, k, rung, made, last = [0.0], 0.0, 0, lowest, 0, len(since) - 1
    h = largest * _RUNG**rung
    while t + 1.5 * h < horizon:
        t += h
        times.append(t)
        made += 1
        while k < last and since[k + 1] <= t:
            k += 1
        highest = int(np.floor(np.log(stretch[k]) / _LOG_RUNG + 1e-9))
        if rung > highest:
            rung, made = highest, 0
            h = largest * _RUNG**rung
        elif rung < highest and made >= equal:
            rung, made = rung + 1, 0
            h = largest * _RUNG**rung
    return np.array([*times, horizon])


def _smooth(pilot: _Run) -> tuple[Floats, Floats]:
    """Return by what steps may be longer, and since when, where the rates of all members are smooth."""
    m = pilot.states.shape[2] // 2
    rates, h = pilot.states[..., m:], np.diff(pilot.times)
    slopes = np.diff(rates, axis=1) / h[:, None]
    bends = np.abs(np.diff(slopes, axis=1)).max(axis=(0, 2)) / (0.5 * (h[1:] + h[:-1]))
    bends = np.where(np.isfinite(bends), bends, np.inf)
    near = np.maximum.reduce([np.roll(bends, k) for k in range(-_NEAR, _NEAR + 1)])
    return pilot.times[1:-1], np.clip(near**-0.5, _SHORTEST, _LONGEST)


def halved(mesh: Floats) -> Floats:
    """Return a mesh with each step in two halves."""
    fine = np.empty(2 * len(mesh) - 1)
    fine[::2], fine[1::2] = mesh, 0.5 * (mesh[1:] + mesh[:-1])
    return fine


@dataclass(frozen=True)
class _Run:
    """What the kernel has filled for b members."""

    times: Floats
    states: Floats
    memory: Floats
    demands: Floats
    auxiliary: Floats
    how: Array
    iterations: Array
    steps: Array
    """How many steps each member was taken before a state was no number, (b,)."""
    limits: Floats
    memory_error: Floats


class _Problem:
    """A loop with its initial states."""

    def __init__(self, loop: ClosedLoop, start: Floats, memory_tolerance: float) -> None:
        assert isinstance(loop.controller, MemoryLaw)
        self.plant, self.law, self.start = loop.plant, loop.controller, start
        self.tolerance = memory_tolerance
        batch, m = len(start), loop.plant.n_controls
        self.limits = np.empty((batch, 2, m))
        bound = np.full((1, 1), np.inf) if loop.saturation is None else loop.saturation.limit
        self.limits[:, 1] = bound
        self.limits[:, 0] = -bound

    def on(self, mesh: Floats) -> _Run:
        """Return the run of all members on a mesh."""
        plant: Any = self.plant
        (batch, n), count = self.start.shape, len(mesh)
        m = n // 2
        orders = self.law.orders(m, batch)
        kernel = sum_of_exponentials(1.0 - orders.ravel(), float(np.diff(mesh).min()), float(mesh[-1]), self.tolerance)
        weights = kernel.weights.reshape(batch, m, -1)
        wanted, wanted_rate = (
            np.array(np.broadcast_to(v, (batch, count, m)), order="C") for v in self.law.reference(mesh)
        )
        begins = np.broadcast_to(self.law.initial_memory(self.start[:, :m] - wanted[:, 0]), (batch, m))
        modes = np.repeat(begins[..., None], len(kernel.rates), axis=2)
        first = self.law.initial_auxiliary(batch)
        states, auxiliary = np.full((batch, count, n), np.nan), np.full((batch, count, first.shape[1]), np.nan)
        states[:, 0], auxiliary[:, 0] = self.start, first
        memory, demands = np.full((batch, count, m), np.nan), np.full((batch, count, m), np.nan)
        how, iterations = np.zeros((batch, count - 1), np.int8), np.zeros((batch, count - 1), np.int32)
        numbers, of_law = plant.kernel_parameters(batch), self.law.numbers(self.plant, batch)
        steps, room = np.empty(batch, dtype=np.int64), room_for(m, first.shape[1], len(kernel.rates))
        for i in range(batch):
            given = Given(
                mesh, numbers[i], of_law[i], wanted[i], wanted_rate[i], orders[i], kernel.rates, weights[i],
                self.limits[i],
            )  # fmt: skip
            path = Path(states[i], memory[i], demands[i], auxiliary[i], modes[i], how[i], iterations[i])
            steps[i] = march(plant.acceleration, self.law.demand, given, path, room)
        demands[:, 0], memory[:, 0] = demands[:, 1], memory[:, 1]
        bound = kernel.error_bound.reshape(batch, m).max(axis=1)
        return _Run(mesh, states, memory, demands, auxiliary, how, iterations, steps, self.limits, bound)


def _ends(plant: StatePlant, run: _Run) -> tuple[Floats, dict[str, Floats], Array]:
    """Return when each member ended, the first time of each event, and the terminal events that ended members."""
    batch = len(run.states)
    end = run.times[run.steps]
    words = np.full(batch, "", dtype=object)
    times = {event.name: np.full(batch, np.nan) for event in plant.events}
    for i in range(batch):
        for event in plant.events:
            at = _first_time(event, run.times[: run.steps[i] + 1], run.states[i])
            if np.isfinite(at):
                times[event.name][i] = at
                if event.terminal and at <= end[i]:
                    end[i], words[i] = at, event.name
    for event in plant.events:
        later = times[event.name] > end
        times[event.name][later] = np.nan
    return end, times, words


def _first_time(event: Event, times: Floats, states: Floats) -> float:
    """Return when an event happens first on a member's mesh, NaN if it does not; by bisection on cubics."""
    below = np.flatnonzero(event.function(times, states[: len(times)]) < 0.0)
    if not below.size:
        return np.nan
    k = max(int(below[0]), 1)
    if event.function(times[:1], states[:1])[0] < 0.0:
        return float(times[0])
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        t, x = _between(times, states, k, middle)
        if event.function(t, x)[0] < 0.0:
            high = middle
        else:
            low = middle
    return float(times[k - 1] + high * (times[k] - times[k - 1]))


def _between(times: Floats, states: Floats, k: int, y: float) -> tuple[Floats, Floats]:
    """Return time (1,) and state (1, 2m) a share y into the step that ends at k."""
    m, h = states.shape[1] // 2, times[k] - times[k - 1]
    a, b = states[k - 1], states[k]
    gap, first, last = b[:m] - a[:m], h * a[m:], h * b[m:]
    position = a[:m] + y * (first + y * (3.0 * gap - 2.0 * first - last + y * (first + last - 2.0 * gap)))
    return np.array([times[k - 1] + y * h]), np.concatenate([position, a[m:] + y * (b[m:] - a[m:])])[None]


def _difference(coarse: _Run, fine: _Run, end: Floats) -> Floats:
    """Return the largest difference of a position at common times over its peak, (b,)."""
    m = fine.states.shape[2] // 2
    alive = (coarse.times <= end[:, None])[..., None]
    ours, theirs = fine.states[:, ::2, :m], coarse.states[..., :m]
    peak = np.where(alive, np.abs(ours), 0.0).max(axis=1)
    gap = np.where(alive, np.abs(ours - theirs), 0.0)
    relative = gap.max(axis=1) / np.maximum(peak, np.finfo(np.float64).tiny)
    largest: Floats = np.where(gap.max(axis=1) == 0.0, 0.0, relative).max(axis=1)
    return np.where(np.isnan(largest), np.inf, largest)
