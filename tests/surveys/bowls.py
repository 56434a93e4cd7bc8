"""An evaluation of closed-form functions of two gains and an order, as a survey needs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fracctl.controllers import Parameter
from fracctl.plants import LinearPlant

Function = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class Law:
    """An order and two gains."""

    @staticmethod
    def parameters(components: object) -> tuple[Parameter, ...]:
        order = Parameter("alpha", default=1.0, lower=0.0, upper=1.0, lower_allowed=False, kind="order")
        return (order, Parameter("k"), Parameter("h"))


@dataclass(frozen=True)
class Bowl:
    """Rows whose objectives are functions of (α, k, h); `calls` holds every point that was evaluated."""

    objectives_by_function: Mapping[str, Function]
    initial_conditions: Mapping[str, float] = field(default_factory=lambda: {"one": 0.0})
    parameters: Mapping[str, float] = field(default_factory=lambda: {"k": 0.0, "h": 0.0})
    effort: Function = lambda alpha, k, h: np.ones_like(k)
    unstable: Function = lambda alpha, k, h: np.zeros(k.shape, dtype=bool)
    calls: list[np.ndarray] = field(default_factory=list)

    law = Law
    plant = LinearPlant(-1.0, components=("w",))
    design_variables = ("alpha", "k", "h")

    @property
    def objectives(self) -> dict[str, tuple[str, ...]]:
        return dict.fromkeys(self.objectives_by_function, ("settling_time", "control_effort"))

    def __call__(self, design: Mapping[str, np.ndarray]) -> dict[str, Any]:
        points = [np.asarray(design[name]) for name in self.design_variables]
        self.calls.append(np.stack(points, axis=1))
        size = len(points[0])
        parts = []
        for name, shift in self.initial_conditions.items():
            unstable = self.unstable(*points)
            rows: dict[str, Any] = dict(zip(self.design_variables, points, strict=True))
            rows |= {f"objective_{o}": f(*points) + shift for o, f in self.objectives_by_function.items()}
            rows |= {"initial_condition": np.full(size, name, dtype=object), "control_effort": self.effort(*points)}
            rows["status"] = np.where(unstable, "unstable", "ok").astype(object)
            rows["stable"] = (~unstable).astype(object)
            parts.append(rows)
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    @property
    def points(self) -> np.ndarray:
        """All points that were evaluated."""
        return np.concatenate(self.calls)


def run(survey: Any, evaluation: Any, fails: tuple[int, ...] = ()) -> dict[int, dict[str, np.ndarray]]:
    """Answer a survey to its end, the last block first; return the rows by block."""
    found: dict[int, dict[str, np.ndarray]] = {}
    waiting: list[Any] = []
    while not survey.finished:
        waiting += survey.ask()
        block = waiting.pop()
        rows = failed(block) if block.number in fails else block.search(evaluation, block.design)
        rows["point"] = block.first_point + rows["point"]
        found[block.number] = rows
        survey.tell(block.number, rows)
    return found


def failed(block: Any) -> dict[str, np.ndarray]:
    """The rows of a block that could not be computed."""
    size = block.size
    rows: dict[str, Any] = dict(block.design) | {"point": np.arange(size)}
    rows |= {"status": np.full(size, "failed", dtype=object), "stable": np.full(size, None, dtype=object)}
    return rows | {name: np.full(size, np.nan) for name in ("objective_f", "objective_g", "control_effort")}
