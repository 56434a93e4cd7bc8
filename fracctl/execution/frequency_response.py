"""Frequency responses of the optima that figures show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from fracctl.arrays import Array, Floats, joined
from fracctl.characteristic.bounds import pole_radius
from fracctl.evaluation import Evaluation
from fracctl.stability.frequency import FrequencyResponse, over
from fracctl.stability.margins import gain

_LOWEST, _LEAST_HIGHEST, _PER_DECADE = 1e-2, 1e2, 300
_NEAR_RESONANCES = np.concatenate([side * np.geomspace(1e-5, 1e-1, 80) for side in (-1.0, 1.0)])


def frequency_responses(evaluation: Evaluation, optima: pd.DataFrame) -> dict[str, Array]:
    """Return the columns of ``frequency_response.parquet``.

    `run` is the index of the optimum, `frequency` ω in units of 1/time. `loop_real` and `loop_imag` are L(iω), with
    several controls det(I + L(iω)) - 1, which encircles -1 as often; `sensitivity` and `complementary` are σ_max of S
    and T.
    """
    nothing = ("frequency", "loop_real", "loop_imag", "sensitivity", "complementary")
    parts: list[dict[str, Array]] = [{"run": np.zeros(0, np.int64)} | {name: np.zeros(0) for name in nothing}]
    for run, row in zip(optima.index.tolist(), optima.to_dict("records"), strict=True):
        parts.append(_response(evaluation, row, run))
    return joined(parts)


def _response(evaluation: Evaluation, row: Mapping[Any, Any], run: int) -> dict[str, Array]:
    loop = evaluation.loop({name: float(row[name]) for name in evaluation.design_variables})
    response = FrequencyResponse(loop)
    omega = _grid(response)
    control, plant = (values[0] for values in response(omega[None], np.zeros(1, dtype=np.int64)))
    encircling = np.linalg.det(plant + control) / np.linalg.det(plant) - 1.0
    return {
        "run": np.full(omega.size, run),
        "frequency": omega,
        "loop_real": encircling.real,
        "loop_imag": encircling.imag,
        "sensitivity": gain(over(plant, plant + control)),
        "complementary": gain(over(control, plant + control)),
    }


def _grid(response: FrequencyResponse) -> Floats:
    """Return frequencies to draw, without the plant's poles on the axis."""
    highest = max(_LEAST_HIGHEST, 10.0 * float(pole_radius(response.matrix).max()))
    even = np.geomspace(_LOWEST, highest, int(_PER_DECADE * np.log10(highest / _LOWEST)))
    near = (response.resonances[:, None] * (1.0 + _NEAR_RESONANCES)).ravel()
    omega = np.unique(np.concatenate([even, near]))
    distance = np.abs(omega[:, None] - response.resonances).min(axis=1, initial=np.inf)
    return np.asarray(omega[distance > 0.5e-5 * omega])
