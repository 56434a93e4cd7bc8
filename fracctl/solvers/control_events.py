"""Where a control ends a motion: the equations of the plant hold for some controls only."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from fracctl.arrays import Floats
from fracctl.meshwise import MeshTrajectory
from fracctl.plants.capabilities import control_events
from fracctl.plants.state import Event
from fracctl.stepwise import StepwiseTrajectory

_HALVINGS = 50
Given = TypeVar("Given", StepwiseTrajectory, MeshTrajectory)


def ended_by_controls(plant: object, trajectory: Given) -> Given:
    """Return a trajectory whose members end where one of the plant's events of the control happens.

    It is looked for at the trajectory's times, and between two of them by bisection.
    """
    if not control_events(plant):
        return trajectory
    batch = replace(trajectory, batched=True)
    end, status, events = trajectory.end.copy(), trajectory.status.copy(), dict(trajectory.events)
    for event in control_events(plant):
        events[event.name] = first = _first(event, batch)
        earlier = first < end
        if event.terminal:
            end[earlier] = first[earlier]
            status[earlier & (status != "failed")] = event.name
    events = {name: np.where(first <= end, first, np.nan) for name, first in events.items()}
    return replace(trajectory, end=end, status=status, events=events)


def _first(event: Event, batch: StepwiseTrajectory | MeshTrajectory) -> Floats:
    """Return the first times of an event, (b,), NaN where it does not happen."""
    controls = batch.controls
    b, count, m = controls.shape
    times = np.broadcast_to(batch.times, (b, count))
    below = event.function(times.ravel(), controls.reshape(b * count, m)).reshape(b, count) < 0.0
    first = np.full(b, np.nan)
    for i in np.flatnonzero(below.any(axis=1)):
        place = int(below[i].argmax())
        low, high = times[i, max(place - 1, 0)], times[i, place]
        for _ in range(_HALVINGS if place else 0):
            middle = np.array([0.5 * (low + high)])
            if event.function(middle, batch.control(middle)[i])[0] < 0.0:
                high = middle[0]
            else:
                low = middle[0]
        first[i] = high
    return first
