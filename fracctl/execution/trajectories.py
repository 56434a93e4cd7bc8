"""Trajectories of the optima that figures show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from fracctl.arrays import Array, Floats, joined
from fracctl.evaluation import Evaluation


def trajectories(evaluation: Evaluation, optima: pd.DataFrame, times: Floats) -> dict[str, Array]:
    """Return the columns of ``trajectories.parquet``: `run` (the index of the optimum), `time`, states, controls."""
    nothing = {name: np.zeros(0) for name in ("time", *evaluation.sampled_columns)}
    parts = [{"run": np.zeros(0, dtype=np.int64)} | nothing]
    for run, row in zip(optima.index.tolist(), optima.to_dict("records"), strict=True):
        parts.append({"run": np.full(times.size, run)} | _samples(evaluation, row, times))
    return joined(parts)


def _samples(evaluation: Evaluation, row: Mapping[Any, Any], times: Floats) -> dict[str, Array]:
    design = {name: float(row[name]) for name in evaluation.design_variables}
    trajectory = evaluation.solve(design, str(row["initial_condition"]))
    return {"time": times} | evaluation.sampled(trajectory, times)
