"""Times of tasks that take turns, so that what else the machine does hits all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Task = Callable[[], object]


@dataclass(frozen=True)
class Timing:
    """Seconds that one unit of a task took, round by round."""

    cpu: Floats
    """Processor time of this process: seconds of one core."""
    wall: Floats
    """Time on the clock; longer where others use the core too."""

    @property
    def seconds(self) -> float:
        """Median of the processor time."""
        return float(np.median(self.cpu))

    @property
    def spread(self) -> float:
        """Distance of the quartiles of the processor time, relative to the median."""
        low, high = np.quantile(self.cpu, [0.25, 0.75])
        return float((high - low) / self.seconds)

    @property
    def on_the_clock(self) -> float:
        """Median of the time on the clock."""
        return float(np.median(self.wall))


def take_turns(tasks: Mapping[str, Task], units: Mapping[str, int], rounds: int) -> dict[str, Timing]:
    """Run every task once unmeasured, then `rounds` times in turn; `units` of work a task does in one call."""
    for task in tasks.values():
        task()
    cpu, wall = (np.empty((len(tasks), rounds)) for _ in range(2))
    for turn in range(rounds):
        for i, task in enumerate(tasks.values()):
            wall_start, cpu_start = time.perf_counter(), time.process_time()
            task()
            cpu[i, turn], wall[i, turn] = time.process_time() - cpu_start, time.perf_counter() - wall_start
    return {name: Timing(cpu[i] / units[name], wall[i] / units[name]) for i, name in enumerate(tasks)}


def ratio(slow: Timing, fast: Timing) -> float:
    """Return how many times longer `slow` takes, the median over the rounds."""
    return float(np.median(slow.cpu / fast.cpu))
