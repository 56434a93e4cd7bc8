"""Families of natural periodic orbits of plants that do not depend on time, followed along a parameter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Array, Complexes, Floats, finite
from fracctl.errors import ArgumentError, suggestion
from fracctl.plants.state import StatePlant
from fracctl.stability.floquet import nontrivial_multipliers, real_above_one
from fracctl.stability.periodic_orbits import PeriodicOrbit

Integral = Callable[[Floats], Array]
"""Takes states (…, n) and returns a number each, e.g. the Jacobi constant."""
_ITERATIONS = 12
_LARGEST_STEP = 0.2
"""Of a correction, over 1 + |x(0)|."""
_AT_REST = 1e-6
"""Where the flow is slower than this a point is an equilibrium, and not an orbit."""
_GROWTH = 4.0
"""An iteration whose error grows by more than this is given up."""
_HALVINGS = 4
_DIFFERENCE = 1e-6


@dataclass(frozen=True)
class FamilyMember:
    """One orbit of a family, with its free motion."""

    orbit: PeriodicOrbit
    value: float
    """Of the parameter."""
    multipliers: Complexes
    """Of the free motion, (n,), by descending magnitude."""
    real_above_one: int
    """Number of real multipliers above 1 (`fracctl.stability.real_above_one`)."""


def family(
    orbit: PeriodicOrbit, parameter: str | Integral, values: ArrayLike, section: str | None = None
) -> tuple[FamilyMember, ...]:
    """Return the orbits of a family at some values of a parameter, each from the ones before it.

    Each orbit solves x(T) = x(0), the section condition and parameter = value for x(0) and the period T, by Newton's
    method on these n + 2 equations for n + 1 unknowns (one equation follows from the others where the plant has a first
    integral). Steps between values should be small enough to stay on one family. Where Newton's method does not
    converge they are halved, four times at most; the family then ends before that value.

    Args:
        orbit: one of the family or near it, e.g. from `shoot_on_section`.
        parameter: ``period``, a state's name for its value at time 0, or a function of states (…, n) that is constant
            on orbits, e.g. `RotatingEllipsoid.jacobi_constant`.
        values: those wanted, (v,), in the order in which they are visited.
        section: name of the state that keeps its value at time 0; None to begin where the correction is orthogonal to
            the flow.

    Raises:
        ArgumentError: the plant depends on time, a name is not known, or no orbit has the first value.
    """
    wanted = np.atleast_1d(finite("values", values))
    _section_row(orbit.plant, orbit.state, section)
    members: list[FamilyMember] = []
    known = [(_parameter(orbit, parameter), orbit)]
    for value in wanted:
        found = _reached(known, parameter, float(value), section)
        if found is None:
            break
        others = nontrivial_multipliers(found)
        every = np.concatenate([others, np.ones(len(found.state) - len(others))])
        ordered = every[np.argsort(-np.abs(every), kind="stable")]
        members.append(FamilyMember(found, float(value), ordered, real_above_one(others)))
    if not members:
        raise ArgumentError("values", wanted.tolist(), "must begin with one that an orbit near the given one has")
    return tuple(members)


def shoot_on_section(
    plant: StatePlant,
    guess: ArrayLike,
    period: float,
    section: str | None = None,
    parameter: str | Integral | None = None,
    value: float = 0.0,
    steps: int = 200,
    tolerance: float = 1e-12,
) -> PeriodicOrbit:
    """Return the orbit nearest to a guess whose period is not known.

    Args:
        plant: one that does not depend on time.
        guess: x(0), (n,).
        period: a guess of T.
        section: name of the state that keeps its value; None for a correction orthogonal to the flow.
        parameter: as for `family`; None to take the correction of least norm.
        value: of the parameter.
        steps: of the method of steps in T.
        tolerance: of all equations, over 1 + |x(0)|.

    Raises:
        ArgumentError: the plant depends on time, the iteration does not converge, or a name is not known.
    """
    state, time = finite("guess", guess), float(period)
    if not np.allclose(_flow(plant, state), _flow(plant, state, 0.37 * time), rtol=1e-9, atol=1e-12):
        raise ArgumentError("plant", plant, "must not depend on time", "use shoot with its period")
    row = _section_row(plant, state, section)
    anchor, cut, size = row @ state, 1e-2 if parameter is None else 1e-9, np.inf
    for _ in range(_ITERATIONS):
        orbit = PeriodicOrbit(plant, state, time, steps)
        gap, before = orbit.gap, size
        wrong = np.append(gap, row @ state - anchor)
        if parameter is not None:
            wrong = np.append(wrong, _parameter(orbit, parameter) - value)
        size = float(np.linalg.norm(wrong))
        if size <= tolerance * (1.0 + float(np.linalg.norm(state))):
            if np.linalg.norm(_flow(plant, state)) <= _AT_REST:
                break
            return orbit
        transition = orbit.transition().real
        if not (size < _GROWTH * before and np.isfinite(transition).all()):
            break
        flow = _flow(plant, state + gap)
        rows = [*np.column_stack([transition - np.eye(len(state)), flow]), np.append(row, 0.0)]
        if parameter is not None:
            rows.append(_slope(orbit, parameter))
        change = np.asarray(np.linalg.lstsq(np.array(rows), wrong, rcond=cut)[0], dtype=np.float64)
        longest = _LARGEST_STEP * (1.0 + float(np.linalg.norm(state)))
        change *= min(1.0, longest / float(np.linalg.norm(change)))
        state, time = state - change[:-1], time - float(change[-1])
        if not time > 0.0:
            break
    raise ArgumentError("guess", np.asarray(guess).tolist(), f"must lie near an orbit of a period near {period:g}")


def _reached(
    known: list[tuple[float, PeriodicOrbit]], parameter: str | Integral, value: float, section: str | None
) -> PeriodicOrbit | None:
    """Return the orbit at a value, from known ones to which those on the way are added; None where there is none."""
    halvings, target = 0, value
    while halvings <= _HALVINGS:
        state, period = _predicted(known, target)
        plant, steps = known[-1][1].plant, known[-1][1].steps
        try:
            found = shoot_on_section(plant, state, period, section, parameter, target, steps)
        except ArgumentError:
            halvings, target = halvings + 1, 0.5 * (known[-1][0] + target)
            continue
        known.append((target, found))
        if target == value:
            return found
        target = value
    return None


def _predicted(known: list[tuple[float, PeriodicOrbit]], value: float) -> tuple[Floats, float]:
    """Return x(0) and T on the line through the last two orbits."""
    (last, orbit), (before, other) = known[-1], known[-2] if len(known) > 1 else known[-1]
    share = 0.0 if last == before else (value - last) / (last - before)
    return orbit.state + share * (orbit.state - other.state), orbit.period + share * (orbit.period - other.period)


def _section_row(plant: StatePlant, state: Floats, section: str | None) -> Floats:
    if section is None:
        flow = _flow(plant, state)
        direction: Floats = flow / np.linalg.norm(flow)
        return direction
    row: Floats = np.eye(len(state))[_index(plant, "section", section)]
    return row


def _parameter(orbit: PeriodicOrbit, parameter: str | Integral) -> float:
    if callable(parameter):
        return float(parameter(orbit.state))
    if parameter == "period":
        return orbit.period
    return float(orbit.state[_index(orbit.plant, "parameter", parameter)])


def _slope(orbit: PeriodicOrbit, parameter: str | Integral) -> Floats:
    """Return the derivatives of a parameter with respect to x(0) and T, (n + 1,)."""
    n = len(orbit.state)
    if callable(parameter):
        steps = _DIFFERENCE * np.eye(n)
        slope = (parameter(orbit.state + steps) - parameter(orbit.state - steps)) / (2.0 * _DIFFERENCE)
        return np.append(np.asarray(slope, dtype=np.float64), 0.0)
    row: Floats = np.eye(n + 1)[n if parameter == "period" else _index(orbit.plant, "parameter", parameter)]
    return row


def _flow(plant: StatePlant, state: Floats, time: float = 0.0) -> Floats:
    rates: Floats = plant.rates(np.array([time]), state[None], np.zeros((1, plant.n_controls)))[0]
    return rates


def _index(plant: StatePlant, argument: str, name: str) -> int:
    names = plant.state_names
    if name not in names:
        known = (*names, "period") if argument == "parameter" else names
        raise ArgumentError(argument, repr(name), f"must be one of {', '.join(known)}{suggestion(name, known)}")
    return names.index(name)
