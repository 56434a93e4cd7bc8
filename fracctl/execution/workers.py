"""What the loop over blocks knows of the executor that it feeds."""

from __future__ import annotations

from abc import abstractmethod
from concurrent.futures import Executor


class WorkerExecutor(Executor):
    """An executor that tells how many processes work for it."""

    @property
    @abstractmethod
    def workers(self) -> int:
        """Number of processes, which may change."""

    @property
    def in_flight(self) -> int:
        """How many calls are worth submitting at a time: while one is computed, each worker has the next."""
        return 2 * self.workers


class WorkerLost(Exception):
    """A worker ended before it answered."""

    attempts = 3
    """How often a call is tried whose worker is lost."""


class OutOfTime(WorkerLost):
    """A worker was killed, for it was busy with a call for too long; most likely it will be again."""

    attempts = 2


class WorkerError(Exception):
    """A call raised, or its result cannot be sent."""
