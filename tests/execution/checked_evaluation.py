"""A real evaluation, out of plane, whose rows are checked with faults on demand; workers build it from plain data."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fracctl.arrays import Array
from fracctl.controllers import PDAlpha
from fracctl.evaluation import Evaluation
from fracctl.measures import SettlingTime
from fracctl.plants import HCWOutOfPlane, LinearPlant
from fracctl.solvers import Contour
from tests.execution.fake_evaluation import commit


@dataclass(frozen=True)
class Checked(Evaluation):
    """Commits its fault where rows with the order `alpha_w` are checked in another process than `parent`."""

    fault: Mapping[str, Any] = field(default_factory=dict)

    def by_law(self, rows: Mapping[str, Array]) -> Iterator[tuple[Evaluation, Array]]:
        if self.fault and os.getpid() != self.fault["parent"] and self.fault["alpha_w"] in rows["alpha_w"]:
            commit(self.fault)
        yield from super().by_law(rows)


def checked(share: float, plant: LinearPlant | None = None, fault: Mapping[str, Any] | None = None) -> Checked:
    return Checked(
        plant or HCWOutOfPlane(),
        PDAlpha,
        {},
        {"ic1": np.array([0.0, 0.002]), "ic2": np.array([-0.001, 0.0])},
        Contour(cross_check=share),
        (SettlingTime(),),
        {"settling_time": ("settling_time",)},
        "settling_time",
        4.0 * np.pi,
        fault or {},
    )


def evaluation(data: Mapping[str, Any]) -> Checked:
    return checked(data["share"], fault=data.get("fault"))
