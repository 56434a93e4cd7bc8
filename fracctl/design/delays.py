"""Delays of delayed feedback from the free motion: a plant's period, or the first return to a section.

The delay must be the period of the orbit that is to be held: with another one no natural orbit makes the control
vanish. Motion relative to a leader wants the leader's period; orbits about a body that turns may return at any time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Floats
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.plants.capabilities import SectionedPlant, period_of
from fracctl.plants.state import Section, StatePlant
from fracctl.solvers.method_of_steps.solver import MethodOfSteps
from fracctl.stepwise import Steps, StepwiseTrajectory

_IN_A_STEP = 8
"""Places in a step where the function of a section is asked for its sign."""
_HALVINGS = 55


def natural_period(plant: StatePlant) -> float:
    """Return the period of the plant's dependence on time, or of its leader's orbit.

    2π for the libration on an elliptic orbit and for motion relative to a leader on a Kepler orbit; the nodal period
    where the leader's orbit is perturbed.

    Raises:
        UnsupportedError: the plant has none.
    """
    period = period_of(plant)
    if period is None:
        raise UnsupportedError(f"{type(plant).__name__} has no period of its own; use `first_return`, or give a delay")
    return period


def first_return(
    plant: StatePlant, states: ArrayLike, section: Section | None = None, horizon: float = 20.0, steps: int = 200
) -> Floats | float:
    """Return the time at which the free motion first crosses a section after time 0, (b,), or a number for one state.

    Crossings in either direction count; a motion that begins on the section has to leave it first.

    Args:
        plant: the plant.
        states: x(0), (n,) or (b, n).
        section: None for the plant's own, x = 0 with y > 0 for the rotating ellipsoid.
        horizon: the latest time that is looked at.
        steps: of the method of steps in 2π of time; the time is as accurate as its states, 1e-10 for most orbits.

    Raises:
        ArgumentError: a state has a wrong shape, or its motion does not return within the horizon or before an event
            (a collision, an escape) ends it; the sentence names the first such member.
        UnsupportedError: there is no section.
    """
    own = plant.section if section is None and isinstance(plant, SectionedPlant) else section
    if own is None:
        raise UnsupportedError(f"{type(plant).__name__} has no section of its own; give `section`")
    trajectory = MethodOfSteps(steps).solve(ClosedLoop(plant), states, horizon)
    times = np.array([_first(own, trajectory, i) for i in range(len(trajectory.end))])
    if np.isnan(times).any():
        raise _no_return(trajectory, int(np.argmax(np.isnan(times))))
    return times if trajectory.batched else float(times[0])


def _first(section: Section, trajectory: StepwiseTrajectory, member: int) -> float:
    """Return the time of the first crossing of one member, NaN where there is none."""
    steps, end = trajectory.steps, trajectory.end[member]
    one = Steps(steps.edges[member : member + 1], np.ascontiguousarray(steps.coefficients[:, :, member, None]), None)
    edges = one.edges[0, : np.searchsorted(one.edges[0], end) + 1]
    shares = np.arange(_IN_A_STEP) / _IN_A_STEP
    times = np.minimum((edges[:-1, None] + np.diff(edges)[:, None] * shares).ravel()[1:], end)
    signs = np.sign(section.function(times, one(times[None])[0]))
    turns: Array = np.flatnonzero(signs[:-1] * signs[1:] <= 0.0)
    crossings = _refined(section, one, times[turns], times[turns + 1], signs[turns + 1])
    counted = crossings[section.side(crossings, one(crossings[None])[0]) > 0.0]
    return float(counted[0]) if counted.size else float("nan")


def _refined(section: Section, steps: Steps, low: Floats, high: Floats, after: Floats) -> Floats:
    """Return times between `low` and `high` (k,) at which the function takes the sign it has `after`, (k,)."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        beyond = np.sign(section.function(middle, steps(middle[None])[0])) == after
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return high


def _no_return(trajectory: StepwiseTrajectory, member: int) -> ArgumentError:
    end, word = trajectory.end[member], trajectory.status[member]
    reason = f"until the horizon {end:g}" if word == "ok" else f"before it ends at {end:g} ({word})"
    state = trajectory.steps(np.zeros((len(trajectory.end), 1)))[member, 0].tolist()
    allowed = f"must return to the section; member {member} does not {reason}"
    return ArgumentError("states", state, allowed, "give a delay, or another section")
