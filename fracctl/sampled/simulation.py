"""Flights of a plant under a sampled law: every period measure, compute, thrust."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Booleans, Floats, finite, positive
from fracctl.errors import ArgumentError
from fracctl.plants.capabilities import batch_of
from fracctl.plants.state import StatePlant
from fracctl.sampled.actuator import Actuator
from fracctl.sampled.controller import DiscreteController
from fracctl.sampled.law import SampledLaw
from fracctl.sampled.navigation import Navigation
from fracctl.sampled.propagation import advance_by
from fracctl.sampled.trajectory import SampledTrajectory

AntiWindup = Literal["none", "hold_integrals", "restart"]


def simulate(
    plant: StatePlant,
    law: SampledLaw | DiscreteController,
    initial_state: ArrayLike,
    horizon: float,
    *,
    actuator: Actuator | None = None,
    navigation: Navigation | None = None,
    anti_windup: AntiWindup = "none",
    earlier: ArrayLike | None = None,
    seed: int = 0,
    numbers: Sequence[int] | None = None,
) -> SampledTrajectory:
    """Fly a batch of members with one controller.

    A measurement at k T_s is answered by a control that acts from (k + delay) T_s on for a period; before the first,
    there is none. Between its changes a linear plant is exact (matrix exponential), another is integrated by DOP853.

    D^α ξ remembers what was measured, not what was asked of the thrusters, so a limit does not wind its memory up;
    integrals of the position it does. ``hold_integrals`` keeps one as it is in a period in which it would drive a
    control at its limit further (conditional integration), ``restart`` begins the whole memory of a member at a limit
    anew at the present measurement, as at switch-on.

    Args:
        plant: with states [ξ, ξ'].
        law: the law, or its controller.
        initial_state: (n,) or (b, n).
        horizon: dimensionless; the next whole number of periods is flown.
        actuator: the thrusters; None for perfect ones.
        navigation: what is measured; None for the true state.
        anti_windup: what a limit does to the memory.
        earlier: recorded measurements [ξ, ξ'] before switch-on, (k, n) or (b, k, n), one a period up to -T_s; None for
            a memory that begins at switch-on.
        seed: of the navigation's noise.
        numbers: of the members, for their seeds, (b,); None for 0 to b - 1.

    Raises:
        ArgumentError: a shape is wrong or a word unknown, or the thrusters cannot give their impulse bit in a period.
    """
    m = plant.n_controls
    start = _states(plant, initial_state)
    if anti_windup not in ("none", "hold_integrals", "restart"):
        raise ArgumentError("anti_windup", repr(anti_windup), "must be 'none', 'hold_integrals' or 'restart'")
    positive("horizon", horizon)
    members = list(range(len(start))) if numbers is None else list(numbers)
    if len(members) != len(start):
        raise ArgumentError("numbers", f"{len(members)} of them", f"must be as many as initial states, {len(start)}")
    controller = law.discrete(m) if isinstance(law, SampledLaw) else law
    count = max(1, math.ceil(horizon / controller.period - 1e-9))
    told = navigation or Navigation()
    errors = told.errors(seed, members, m, -(-count // told.every))
    recorded = None if earlier is None else _recorded(earlier, len(start), 2 * m)
    thrusters = actuator or Actuator()
    thrusters.check(m, controller.period)

    x, states, commands = start, np.empty((count + 1, *start.shape)), np.zeros((count, len(start), m))
    limits = np.zeros(len(start))
    states[0] = x
    move = _mover(plant, controller)
    memory = measured = np.zeros(0)
    for k in range(count):
        if k % told.every == 0:
            measured = x[:, : 2 * m] + next(errors)
        if k == 0:
            memory = controller.start(measured, recorded)
        following, demand = controller.step(memory, measured)
        commands[k], limited = thrusters(demand, controller.period)
        limits += limited.any(axis=1)
        if anti_windup != "none" and limited.any():
            following = _kept(controller, memory, following, demand, limited, measured, anti_windup)
        memory = following
        states[k + 1] = x = move(k, x, commands)
    return SampledTrajectory(
        plant,
        controller.period,
        controller.delay,
        np.ascontiguousarray(np.swapaxes(states, 0, 1)),
        np.ascontiguousarray(np.swapaxes(commands, 0, 1)),
        limits / count,
        np.where(np.isfinite(x).all(axis=1), "ok", "diverged").astype(object),
        np.ndim(initial_state) == 2 or batch_of(plant) is not None,
    )


def _mover(plant: StatePlant, controller: DiscreteController) -> Callable[[int, Floats, Floats], Floats]:
    """Return what takes the states of period k on to the next, under the commands (K, b, m) known by then."""
    whole, late = divmod(controller.delay, 1.0)
    before, after = (advance_by(plant, share * controller.period) for share in (late, 1.0 - late))

    def move(k: int, x: Floats, commands: Floats) -> Floats:
        newest, idle = k - int(whole), np.zeros(commands.shape[1:])
        if late:
            x = before(k * controller.period, x, commands[newest - 1] if newest >= 1 else idle)
        return after((k + late) * controller.period, x, commands[newest] if newest >= 0 else idle)

    return move


def _kept(
    controller: DiscreteController,
    memory: Floats,
    following: Floats,
    demand: Floats,
    limited: Booleans,
    measured: Floats,
    anti_windup: AntiWindup,
) -> Floats:
    """Return the next states, with what a limit does to them."""
    if anti_windup == "restart":
        anew, _ = controller.step(controller.start(measured), measured)
        return np.where(np.any(limited, axis=1, keepdims=True), anew, following)
    kept = following.copy()
    for position in range(controller.n_controls):
        own = np.flatnonzero(controller.integral_of == position)
        driven = ((following - memory)[:, None, own] * controller.c[:, own]).sum(axis=2)
        further = np.any(limited & (driven * demand > 0.0), axis=1, keepdims=True)
        kept[:, own] = np.where(further, memory[:, own], following[:, own])
    return kept


def _states(plant: StatePlant, initial_state: ArrayLike) -> Floats:
    start = finite("initial_state", initial_state)
    n, own = plant.n_states, batch_of(plant)
    if start.ndim not in (1, 2) or start.shape[-1] != n or n != 2 * plant.n_controls:
        allowed = f"must have shape ({n},) or (b, {n}), positions and as many velocities"
        raise ArgumentError("initial_state", f"of shape {start.shape}", allowed)
    if own is not None and start.ndim == 2 and len(start) != own:
        allowed = f"must have the batch size of the plant, {own}"
        raise ArgumentError("initial_state", f"a batch of {len(start)}", allowed)
    return np.array(np.broadcast_to(start, (own or len(np.atleast_2d(start)), n)))


def _recorded(earlier: ArrayLike, batch: int, width: int) -> Floats:
    values = finite("earlier", earlier)
    values = values[None] if values.ndim == 2 else values
    if values.ndim != 3 or values.shape[0] not in (1, batch) or values.shape[2] != width:
        raise ArgumentError("earlier", f"of shape {values.shape}", f"must have shape (k, {width}) or (b, k, {width})")
    return np.ascontiguousarray(np.broadcast_to(values, (batch, *values.shape[1:])))
