"""Trajectories of the optima that figures show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from fracctl.arrays import Array, Floats
from fracctl.evaluation import Evaluation


def trajectories(evaluation: Evaluation, optima: pd.DataFrame, times: Floats) -> dict[str, Array]:
    """Return the columns of ``trajectories.parquet``: `run` (the index of the optimum), `time`, states, controls."""
    plant = evaluation.plant
    names = (*plant.state_names, *(f"control_{component}" for component in plant.components))
    solved = [_samples(evaluation, row, times) for row in optima.to_dict("records")]
    samples = np.concatenate(solved) if solved else np.zeros((0, len(names)))
    columns: dict[str, Array] = {
        "run": np.repeat(optima.index.to_numpy(dtype=np.int64), times.size),
        "time": np.tile(times, len(optima)),
    }
    return columns | {name: samples[:, i] for i, name in enumerate(names)}


def _samples(evaluation: Evaluation, row: Mapping[Any, Any], times: Floats) -> Floats:
    """States and controls, (t, n + m)."""
    design = {name: float(row[name]) for name in evaluation.design_variables}
    trajectory = evaluation.solve(design, str(row["initial_condition"]))
    states = trajectory(times)[:, : len(evaluation.plant.state_names)]
    return np.concatenate([states, trajectory.control(times)], axis=1)
