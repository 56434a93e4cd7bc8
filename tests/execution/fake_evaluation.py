"""An evaluation without physics, cheap and deterministic, with faults on demand; workers build it from plain data."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fracctl.controllers import PDAlpha
from fracctl.evaluation import Conclusion
from fracctl.loop import ClosedLoop
from fracctl.plants import LinearPlant
from fracctl.solvers import Contour
from fracctl.trajectory import Trajectory


class FakeEvaluation:
    """A bowl over the gains with its bottom at k = (α, 2α); the control effort goes through a matrix product."""

    design_variables = ("alpha_w", "k_p_w", "k_d_w")
    row_columns = (
        "initial_condition",
        *design_variables,
        "settling_time",
        "control_effort",
        "objective",
        "objective_time",
        "objective_joint",
        "status",
        "stable",
        "error_estimate",
        "nodes",
    )
    objectives = {"time": ("settling_time",), "joint": ("settling_time", "control_effort")}  # noqa: RUF012
    objective = "time"
    horizon = 10.0
    plant = LinearPlant(-1.0, components=("w",))
    measures = ()
    solver = Contour()
    has_poles = True
    sliced_by = None
    trajectory_kinds = ("overall", "baseline")
    trajectory_samples = 2001
    sampled_columns = ("w", "w_dot", "control_w")

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.initial_conditions = {name: np.ones(2) for name in data.get("initial_conditions", ["one", "two"])}
        self.faults: list[dict[str, Any]] = data.get("faults", [])
        self.seconds: float = data.get("seconds", 0.0)
        self.started: str | None = data.get("started")

    def __call__(self, design: Mapping[str, np.ndarray]) -> dict[str, Any]:
        if self.started:
            Path(self.started).touch()
        time.sleep(self.seconds)
        for fault in self.faults:
            if design["alpha_w"][0] == fault["alpha_w"]:
                commit(fault)
        parts = [self._rows(name, i, design) for i, name in enumerate(self.initial_conditions)]
        rows = {name: np.concatenate([part[name] for part in parts]) for name in self.row_columns}
        if any(f["kind"] == "returns nonsense" and design["alpha_w"][0] == f["alpha_w"] for f in self.faults):
            del rows["nodes"]
        if any(
            f["kind"] == "returns what cannot be sent" and design["alpha_w"][0] == f["alpha_w"] for f in self.faults
        ):
            rows["note"] = np.array([lambda: None], dtype=object)
        return rows

    def _rows(self, name: str, shift: int, design: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        alpha, k_p, k_d = (np.asarray(design[column]) for column in self.design_variables)
        settling = alpha + (k_p - alpha) ** 2 + (k_d - 2.0 * alpha) ** 2 + shift
        product = np.cos(np.outer(k_p + alpha, np.arange(200.0))) @ np.sin(np.outer(np.arange(200.0), np.arange(64.0)))
        effort = np.abs(product).mean(axis=1) * (k_p + k_d)
        size = alpha.size
        with np.errstate(invalid="ignore"):
            joint = np.sqrt(np.where(settling < 6.0 + shift, settling, np.inf) * effort)
        settled = settling < 6.0 + shift
        settling = np.where(settled, settling, np.inf)
        return {
            "initial_condition": np.full(size, name, dtype=object),
            "alpha_w": alpha,
            "k_p_w": k_p,
            "k_d_w": k_d,
            "settling_time": settling,
            "control_effort": effort,
            "objective": settling,
            "objective_time": settling,
            "objective_joint": joint,
            "status": np.where(settled, "ok", "unsettled").astype(object),
            "stable": np.where(k_d > 0.0, True, None),
            "error_estimate": np.full(size, 1e-9),
            "nodes": np.arange(size),
        }

    def loop(self, design: Mapping[str, float]) -> ClosedLoop:
        return ClosedLoop(self.plant, PDAlpha(design["k_p_w"], design["k_d_w"], design["alpha_w"]))

    def sampled(self, trajectory: Trajectory, times: np.ndarray) -> dict[str, np.ndarray]:
        return dict(zip(self.sampled_columns, np.hstack([trajectory(times), trajectory.control(times)]).T, strict=True))

    def conclude(self, parts: Iterable[Mapping[str, Any]]) -> Conclusion:
        return Conclusion()

    def solve(self, design: Mapping[str, float], initial_condition: str, horizon: float = 10.0) -> FakeTrajectory:
        return FakeTrajectory(design["alpha_w"])


@dataclass(frozen=True)
class FakeTrajectory:
    rate: float

    def __call__(self, times: np.ndarray) -> np.ndarray:
        decay = np.exp(-self.rate * times)
        return np.stack([decay, -self.rate * decay], axis=1)

    def control(self, times: np.ndarray) -> np.ndarray:
        return self(times)[:, 1:]


def commit(fault: Mapping[str, Any]) -> None:
    """Do what the fault says; only once if it has a `once` file."""
    if "once" in fault:
        path = Path(fault["once"])
        if path.exists():
            return
        path.touch()
    if fault["kind"] == "raises":
        raise ValueError("the fault was asked for\nand has a second line")
    if fault["kind"] == "is killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if fault["kind"] == "exits":
        sys.exit(3)
    if fault["kind"] == "exits at once":
        os._exit(3)
    if fault["kind"] == "hangs":
        time.sleep(600.0)
    if fault["kind"] == "hangs in a library":
        ctypes.PyDLL(None).sleep(600)  # and lets no other thread of its process run


def evaluation(data: Mapping[str, Any]) -> FakeEvaluation:
    return FakeEvaluation(data)
