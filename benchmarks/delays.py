"""Delayed feedback: orbits about Eros for a batch of gains, and jitcdde at equal accuracy.

Of jitcdde's tolerances the one that is judged is the cheapest whose error is at most `ASKED`, or, where none is, the
most accurate.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd

from benchmarks import machine
from benchmarks.orbits import DELAY, ORBITS, PLANT, START, Floats, gains, matrices, truth
from benchmarks.timing import Task, Timing, ratio, take_turns
from benchmarks.verdicts import Verdict, at_least, at_most
from fracctl.controllers import DelayedFeedback
from fracctl.loop import ClosedLoop
from fracctl.solvers import MethodOfSteps

BATCH, ROUNDS, ASKED, STEPS = 256, 5, 1e-9, 50
TOLERANCES = (1e-9, 1e-11, 1e-12, 1e-13)
ONE, MANY = "fracctl, one run", f"fracctl, {BATCH} runs"
_CHECKED = 4


def stepped(rows: Floats, steps: int = STEPS) -> Floats:
    """Return the states at the ends of the controlled orbits, (r, ORBITS, 4), by the method of steps."""
    loop = ClosedLoop(PLANT, DelayedFeedback(matrices(rows), DELAY))
    trajectory = MethodOfSteps(steps).solve(loop, START, (ORBITS + 1) * DELAY)
    return trajectory(np.minimum(DELAY * np.arange(2, ORBITS + 2), trajectory.horizon))


def peers() -> tuple[list[Any], Any, list[str]]:
    """Return jitcdde with all tolerances, its module (None where it is missing), and a sentence where it is."""
    try:
        module = import_module("benchmarks.peers.delay_equations")
    except ModuleNotFoundError as error:
        return [], None, [f"{error.name} is not installed (extra `bench`)"]
    return [module.JitcDDE(tolerance) for tolerance in TOLERANCES], module, []


def measure() -> tuple[pd.DataFrame, list[Verdict], list[str]]:
    """Time both in turn; return table, verdicts and notes."""
    found, module, missing = peers()
    checked = gains(BATCH)[:_CHECKED]
    exact = np.array([truth(row) for row in checked])
    build = 0.0 if module is None else module.build_seconds()
    tasks: dict[str, Task] = {ONE: partial(stepped, checked[:1]), MANY: partial(stepped, gains(BATCH))}
    tasks |= {peer.setting: partial(peer, checked[:1]) for peer in found}
    timings = take_turns(tasks, {name: BATCH if name == MANY else 1 for name in tasks}, ROUNDS)
    own = float(np.abs(stepped(checked) - exact).max())
    rows = [_row("fracctl", name, own, timings, name) for name in (ONE, MANY)]
    errors = [float(np.abs(peer(checked) - exact).max()) for peer in found]
    rows += [_row(p.package, p.setting, error, timings, p.setting) for p, error in zip(found, errors, strict=True)]
    table = pd.DataFrame(rows)
    verdicts = [at_most(f"error of fracctl with {STEPS} steps to a delay", ASKED, own)]
    return table, verdicts + _verdicts(table, timings, build), missing


def _row(package: str, setting: str, error: float, timings: dict[str, Timing], key: str) -> dict[str, Any]:
    timing = timings[key]
    return {
        "package": package,
        "setting": setting,
        "error": error,
        "ms a run": 1e3 * timing.seconds,
        "spread": timing.spread,
        "over the batch": ratio(timing, timings[MANY]),
        "load": machine.load(),
    }


def _verdicts(table: pd.DataFrame, timings: dict[str, Timing], build: float) -> list[Verdict]:
    rows = table[table["package"] == "jitcdde"]
    if not len(rows):
        return []
    enough = rows[rows["error"] <= ASKED]
    row = (enough.sort_values("ms a run") if len(enough) else rows.sort_values("error")).iloc[0]
    words, seconds = f"{row['setting']}, error {row['error']:.0e}", 1e-3 * float(row["ms a run"])
    return [
        at_least(f"jitcdde over a batch of {BATCH}, a run: {words}", 50.0, float(row["over the batch"])),
        at_least(f"jitcdde with its build over one run: {words}", 1.0, (build + seconds) / timings[ONE].seconds),
        at_least(f"jitcdde without its build over one run: {words}", 1.0, seconds / timings[ONE].seconds),
    ]
