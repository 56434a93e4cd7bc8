"""Certified evaluations a second on one core, against what was asked and against the bare products."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from benchmarks import limit, machine
from benchmarks.cases import Case, Truth, case, grid_gains, wide_gains
from benchmarks.peers.base import output_times
from benchmarks.timing import Task, Timing, ratio, take_turns
from benchmarks.verdicts import Verdict, at_least, at_most

ROUNDS = 7
ASKED = {"out-of-plane": 150_000.0, "in-plane": 100_000.0}
LARGEST_RATIO_TO_LIMIT = 4.0
TOLERANCE = 1e-8
_ALL = ("ic1", "ic2", "ic3")
_CHECKED = 4
"""Members of each batch that are compared with references."""


@dataclass(frozen=True)
class Measured:
    """A case in words, and whether it is the one that was asked for."""

    words: str
    case: Case
    judged: bool = False


def measured_cases() -> list[Measured]:
    """Return what is timed."""
    out, plane = "out-of-plane", "in-plane"
    return [
        Measured("gains in [0, 2]", case(out), judged=True),
        Measured("gains in [0, 2], α = 1", case(out, alpha=(1.0,))),
        Measured("gains in [0, 2], 256 points", case(out, 256)),
        Measured("gains in [0, 2], 16384 points", case(out, 16_384)),
        Measured("gains in [0, 2], three starts", case(out, initial_conditions=_ALL)),
        Measured("gains in [0, 2], 12π", case(out, periods=6.0)),
        Measured(
            "41 × 41 gains, three starts, 12π", case(out, periods=6.0, initial_conditions=_ALL, gains=grid_gains())
        ),
        Measured("LQR gains ± 0.5", case(plane), judged=True),
        Measured("LQR gains ± 0.5, α = 1", case(plane, alpha=(1.0, 1.0))),
        Measured("LQR gains ± 0.5, 256 points", case(plane, 256)),
        Measured("LQR gains ± 0.5, 16384 points", case(plane, 16_384)),
        Measured("LQR gains ± 0.5, three starts", case(plane, initial_conditions=_ALL)),
        Measured("LQR gains ± 0.5, 12π", case(plane, periods=6.0)),
        Measured("gains in ± 8", case(plane, gains=wide_gains(4096))),
    ]


def measure() -> tuple[pd.DataFrame, list[Verdict]]:
    """Time all cases and the bare products in turn; return the table and the verdicts on what was asked."""
    measured = measured_cases()
    limits = {plane: limit.products(4096, 2 * outputs) for plane, outputs in (("out-of-plane", 1), ("in-plane", 2))}
    tasks: dict[str, Task] = {f"{one.case.plane}, {one.words}": one.case.rows for one in measured}
    units = {f"{one.case.plane}, {one.words}": one.case.size for one in measured}
    timings = take_turns(tasks | limits, units | dict.fromkeys(limits, 4096), ROUNDS)
    rows = [_row(one, timings[f"{one.case.plane}, {one.words}"], timings[one.case.plane]) for one in measured]
    rows += [_limit_row(plane, timings[plane]) for plane in limits]
    verdicts = [verdict for one in measured if one.judged for verdict in _verdicts(one, timings)]
    return pd.DataFrame(rows), verdicts


def _row(one: Measured, timing: Timing, bare: Timing) -> dict[str, Any]:
    rows = one.case.rows()
    status = pd.Series(rows["status"]).value_counts(normalize=True)
    unstable = float(status.get("unstable", 0.0))
    return {
        "plane": one.case.plane,
        "batch": one.words,
        "design points": len(one.case.gains),
        "evaluations": one.case.size,
        "evaluations a second": 1.0 / timing.seconds,
        "on the clock": 1.0 / timing.on_the_clock,
        "µs": 1e6 * timing.seconds,
        "spread": timing.spread,
        "over the limit": ratio(timing, bare) if one.case.evaluation.horizon < 13.0 and not unstable else float("nan"),
        "unstable": unstable,
        "failed": float(status.get("failed", 0.0)),
        "nodes": float(np.mean(np.asarray(rows["nodes"], dtype=float))),
        "load": machine.load(),
    }


def _limit_row(plane: str, timing: Timing) -> dict[str, Any]:
    return {
        "plane": plane,
        "batch": f"the bare products, {limit.TIMES} times, nodes {', '.join(map(str, limit.NODES))}",
        "evaluations": 4096,
        "evaluations a second": 1.0 / timing.seconds,
        "on the clock": 1.0 / timing.on_the_clock,
        "µs": 1e6 * timing.seconds,
        "spread": timing.spread,
        "over the limit": 1.0,
        "load": machine.load(),
    }


def _verdicts(one: Measured, timings: dict[str, Timing]) -> list[Verdict]:
    plane, timing = one.case.plane, timings[f"{one.case.plane}, {one.words}"]
    over = ratio(timing, timings[plane])
    rate = f"certified {plane} evaluations a second a core"
    return [
        at_least(rate, ASKED[plane], 1.0 / timing.seconds),
        at_most(f"error of positions and controls, {plane}, relative to the peak", TOLERANCE, engine_error(one.case)),
        at_most(f"time over that of the bare products, {plane}", LARGEST_RATIO_TO_LIMIT, over),
    ]


def engine_error(batch: Case) -> float:
    """Return the largest error of some members, as a survey solves them, at 401 times."""
    times = output_times(batch.evaluation.horizon)
    truth = Truth([batch.loop(member) for member in range(_CHECKED)], batch.evaluation.horizon)
    return max(truth.error(member, times, *batch.trajectory(member, times)) for member in range(_CHECKED))
