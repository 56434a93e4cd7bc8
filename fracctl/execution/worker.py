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
from typing import TYPE_CHECKING, Any, Protocol, cast

from fracctl.arrays import Array, Floats
from fracctl.errors import FracctlError

if TYPE_CHECKING:
    import pandas as pd


class Evaluator(Protocol):
    """What execution needs to know of `fracctl.evaluation.Evaluation`."""

    @property
    def design_variables(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def row_columns(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def initial_conditions(self) -> Mapping[str, Floats]: ...  # noqa: D102
    @property
    def objectives(self) -> Mapping[str, tuple[str, ...]]: ...  # noqa: D102
    @property
    def objective(self) -> str: ...  # noqa: D102
    @property
    def horizon(self) -> float: ...  # noqa: D102

    def __call__(self, design: Mapping[str, Floats]) -> Mapping[str, Array]:
        """Rows of all points, initial condition outermost."""
        ...

    def trajectories(self, rows: pd.DataFrame, times: Floats) -> Mapping[str, Array]:
        """Trajectories of rows at the given times; `run` is the index of the row."""
        ...


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
        return cls(factory, json.dumps(data, sort_keys=True))

    def evaluation(self) -> Evaluator:
        """Return the evaluation, built at the first call in this process."""
        return _build(self)


@lru_cache(maxsize=4)
def _build(work: Work) -> Evaluator:
    module, _, name = work.factory.partition(":")
    return cast(Evaluator, getattr(importlib.import_module(module), name)(json.loads(work.data)))


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


def evaluate(work: Work, design: Mapping[str, Floats]) -> Outcome:
    """Evaluate a block; whatever goes wrong in it becomes an outcome with a reason."""
    started = time.process_time()
    try:
        evaluation = work.evaluation()
        rows = evaluation(design)
        _check(rows, evaluation, design)
    except (Exception, SystemExit) as problem:  # noqa: BLE001 - becomes a row with its reason
        return Outcome(None, describe(problem), traceback.format_exc())
    return Outcome(rows, cpu_time_s=time.process_time() - started, process=os.getpid())


def describe(problem: BaseException) -> str:
    """Return an exception in one line; ours are sentences already."""
    name = "" if isinstance(problem, FracctlError) else f"{type(problem).__name__}: "
    return f"{name}{problem}".splitlines()[0].strip().removesuffix(":")


def _check(rows: Mapping[str, Array], evaluation: Evaluator, design: Mapping[str, Floats]) -> None:
    expected = len(next(iter(design.values()))) * len(evaluation.initial_conditions)
    wrong = [name for name in evaluation.row_columns if name not in rows or len(rows[name]) != expected]
    if wrong:
        raise ValueError(f"the evaluation must return {expected} values of {', '.join(wrong)}")
