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


class WorkerError(Exception):
    """A call raised, or its result cannot be sent."""
