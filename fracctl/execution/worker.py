"""What runs in a worker: build the evaluation once, evaluate block after block."""

from __future__ import annotations

import importlib
import json
import os
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from fracctl.arrays import Array
from fracctl.errors import FracctlError
from fracctl.surveys.base import POINT, SEARCH_COLUMNS, Block

if TYPE_CHECKING:
    from fracctl.evaluation import Evaluation


@dataclass(frozen=True)
class Work:
    """An evaluation as plain data; every process builds its own."""

    factory: str
    """``package.module:function``; the function takes `data` and returns the evaluation."""
    data: str
    """JSON."""

    @classmethod
    def of(cls, factory: str, data: Any) -> Work:
        """Return the work of `factory` with plain data."""
        return cls(factory, json.dumps(data))

    def evaluation(self) -> Evaluation:
        """Return the evaluation, built at the first call in this process."""
        return _build(self)


@lru_cache(maxsize=4)
def _build(work: Work) -> Evaluation:
    module, _, name = work.factory.partition(":")
    evaluation: Evaluation = getattr(importlib.import_module(module), name)(json.loads(work.data))
    return evaluation


@dataclass(frozen=True)
class Outcome:
    """What became of a block."""

    rows: Mapping[str, Array] | None
    """Its rows, None if it failed."""
    reason: str | None = None
    """Why it failed, in one line."""
    trace: str = ""
    """Where it failed, for the log."""
    cpu_time_s: float = 0.0
    """CPU time it took."""
    process: int = 0
    """Process that it ran in."""


def evaluate(work: Work, block: Block) -> Outcome:
    """Evaluate a block, or search from it; whatever goes wrong in it becomes an outcome with a reason."""
    started = time.process_time()
    try:
        evaluation = work.evaluation()
        rows = evaluation(block.design) if block.search is None else block.search(evaluation, block.design)
        _check(rows, evaluation, block)
    except (Exception, SystemExit) as problem:  # noqa: BLE001 - becomes a row with its reason
        return Outcome(None, describe(problem), traceback.format_exc())
    return Outcome(rows, cpu_time_s=time.process_time() - started, process=os.getpid())


def describe(problem: BaseException) -> str:
    """Return an exception in one line; ours are sentences already."""
    name = "" if isinstance(problem, FracctlError) else f"{type(problem).__name__}: "
    return f"{name}{problem}".splitlines()[0].strip().removesuffix(":")


def _check(rows: Mapping[str, Array], evaluation: Evaluation, block: Block) -> None:
    if block.search is None:
        wanted, expected = evaluation.row_columns, block.size * len(evaluation.initial_conditions)
    else:
        wanted = (*evaluation.row_columns, POINT, *SEARCH_COLUMNS)
        expected = max(block.size, *map(len, rows.values()))
    wrong = [name for name in wanted if name not in rows or len(rows[name]) != expected]
    if wrong:
        raise ValueError(f"the evaluation must return {expected} values of {', '.join(wrong)}")
