"""One loop that takes a survey's blocks through an executor, whichever it is."""

from __future__ import annotations

import logging
from collections import Counter, deque
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Protocol

from fracctl.errors import RunError
from fracctl.execution.progress import Progress
from fracctl.execution.worker import Outcome, Work, describe, evaluate
from fracctl.execution.workers import OutOfTime, WorkerExecutor, WorkerLost
from fracctl.surveys import Block, Survey
from fracctl.surveys.base import Rows

_log = logging.getLogger(__name__)


class BlockStore(Protocol):
    """Where rows are kept."""

    def load(self, block: Block) -> Rows | None:
        """Return the rows of a block that is stored, None if it is to be computed."""
        ...

    def save(self, block: Block, outcome: Outcome) -> Rows:
        """Store what became of a block and return its rows."""
        ...


class Scheduler:
    """Runs a survey to its end.

    As many blocks are submitted at a time as the executor has in flight. A block whose worker is lost is submitted
    again, as often as `WorkerLost` or `OutOfTime` says; any other failure is final for this run.

    Args:
        survey: what is asked and told.
        executor: where blocks run; it is shut down at Ctrl-C.
        work: the evaluation.
        store: keeps the rows of finished blocks, and answers for those it has.
        progress: is told of every block that is stored.

    Raises:
        RunError: workers die one after the other, the executor has none left, or the store cannot be written.
        KeyboardInterrupt: Ctrl-C; blocks that were done by then are stored, all others are abandoned at once.
    """

    def __init__(
        self,
        survey: Survey,
        executor: WorkerExecutor,
        work: Work,
        store: BlockStore,
        progress: Progress,
    ) -> None:
        self._survey, self._executor, self._work, self._store = survey, executor, work, store
        self._progress = progress
        self._queue: deque[Block] = deque()
        self._pending: dict[Future[Outcome], Block] = {}
        self._attempts: Counter[int] = Counter()
        self._lost_in_a_row = 0

    def run(self) -> None:
        """Ask, evaluate, store, tell, until the survey is finished."""
        try:
            while not self._survey.finished:
                self._submit()
                self._collect()
        except KeyboardInterrupt:
            self._executor.shutdown(cancel_futures=True)
            self._keep_what_is_done()
            raise

    def _submit(self) -> None:
        while len(self._pending) < self._executor.in_flight:
            block = self._next()
            if block is None:
                return
            self._pending[self._executor.submit(evaluate, self._work, block)] = block

    def _next(self) -> Block | None:
        """The next block that is not stored; those that are, are told on the way."""
        while True:
            if not self._queue:
                self._queue.extend(self._survey.ask())
            if not self._queue:
                return None
            block = self._queue.popleft()
            rows = self._store.load(block)
            if rows is None:
                return block
            self._survey.tell(block.number, rows)
            self._progress.found(block.size)

    def _collect(self) -> None:
        if not self._pending:
            if self._survey.finished:
                return
            raise RunError("the survey is not finished, but has no further points to evaluate")
        done, _ = wait(self._pending, return_when=FIRST_COMPLETED)
        for future in sorted(done, key=lambda one: self._pending[one].number):
            self._take(self._pending[future], future)
            del self._pending[future]

    def _take(self, block: Block, future: Future[Outcome]) -> None:
        try:
            outcome = future.result()
            self._lost_in_a_row = 0
        except WorkerLost as problem:
            self._attempts[block.number] += 1
            self._lost_in_a_row += not isinstance(problem, OutOfTime)
            if self._lost_in_a_row > WorkerLost.attempts * self._executor.in_flight:
                raise RunError(f"worker processes keep ending: {problem}; scheduler=serial does without") from None
            if self._attempts[block.number] < problem.attempts:
                _log.warning("block %d is tried again: %s", block.number, problem)
                self._queue.appendleft(block)
                return
            outcome = Outcome(None, str(problem))
        except RunError:
            raise
        except Exception as problem:  # noqa: BLE001 - becomes rows with their reason
            outcome = Outcome(None, describe(problem))
        self._survey.tell(block.number, self._store.save(block, outcome))
        self._progress.advance(block.size)

    def _keep_what_is_done(self) -> None:
        for future, block in self._pending.items():
            if future.done() and not future.cancelled() and future.exception() is None:
                self._store.save(block, future.result())
