"""A tether under FDA-SMC, one run and a Monte Carlo batch, and SciPy's stiff integrators at equal accuracy.

Of the settings of each method the one that is judged is the cheapest whose error is at most ours. The truth is LSODA
with a tolerance of 1e-10; the error is the largest of λ, θ and φ over two orbits.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks import machine
from benchmarks.peers.stiff_equations import SciPy
from benchmarks.timing import Task, Timing, ratio, take_turns
from benchmarks.verdicts import Verdict, at_least, at_most
from fracctl.controllers import AdaptiveSlidingMode, Saturation
from fracctl.loop import ClosedLoop
from fracctl.plants import Tether
from fracctl.solvers import ImplicitMemory

Floats = NDArray[np.float64]

BATCH, ROUNDS, ASKED = 64, 3, 1e-5
START = np.array([0.0009, 0.1, 0.1, 0.7, 0.0, 0.0])
TIMES = np.linspace(0.0, 4.0 * np.pi, 401)
TRUTH = SciPy("LSODA", 1e-10)
PEERS = (
    *(SciPy(method, tolerance) for method in ("LSODA", "BDF") for tolerance in (1e-4, 1e-5, 1e-6)),
    *(SciPy("LSODA", tolerance, compiled=False) for tolerance in (1e-5, 1e-6)),
)
ONE, MANY = "fracctl, one run", f"fracctl, {BATCH} runs"


def starts(count: int) -> Floats:
    """Return releases with uncertain speed and angles, the nominal one first, (count, 6)."""
    random = np.random.default_rng(1)
    states = np.repeat(START[None], count, axis=0)
    states[1:, 1:3] += 0.03 * random.standard_normal((count - 1, 2))
    states[1:, 3] += 0.02 * random.standard_normal(count - 1)
    return states


def implicit(states: Floats) -> Floats:
    """Return the states at the times, (r, t, 6)."""
    plant = Tether()
    loop = ClosedLoop(plant, AdaptiveSlidingMode(), Saturation(plant.limits, "axis"))
    return ImplicitMemory().solve(loop, states, float(TIMES[-1]))(TIMES)


def measure() -> tuple[pd.DataFrame, list[Verdict], list[str]]:
    """Time all in turn; return table, verdicts and notes."""
    one = starts(1)
    truth = TRUTH(one, TIMES)
    tasks: dict[str, Task] = {ONE: partial(implicit, one), MANY: partial(implicit, starts(BATCH))}
    tasks |= {peer.setting: partial(peer, one, TIMES) for peer in PEERS}
    timings = take_turns(tasks, {name: BATCH if name == MANY else 1 for name in tasks}, ROUNDS)
    own = _error(implicit(one), truth)
    rows = [_row("fracctl", name, own, timings, name) for name in (ONE, MANY)]
    rows += [_row(p.package, p.setting, _error(p(one, TIMES), truth), timings, p.setting) for p in PEERS]
    table = pd.DataFrame(rows)
    verdicts = [at_most("tether: error of fracctl over two orbits", ASKED, own)]
    return table, [*verdicts, *_verdicts(table, timings, own)], []


def _error(states: Floats, truth: Floats) -> float:
    return float(np.abs(states - truth)[:, 1:, :3].max())


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


def _verdicts(table: pd.DataFrame, timings: dict[str, Timing], own: float) -> list[Verdict]:
    """Judge each method by its fastest setting that is as exact; in a batch, against LSODA as it is mostly written."""
    found = []
    for method, written in (("LSODA", False), ("BDF", False), ("LSODA", True)):
        names = table["setting"]
        rows = table[names.str.startswith(method) & (names.str.endswith("NumPy") == written)]
        enough = rows[rows["error"] <= 1.2 * own]
        row = (enough.sort_values("ms a run") if len(enough) else rows.sort_values("error")).iloc[0]
        words = f"{row['setting']}, error {row['error']:.0e}"
        single = ratio(timings[str(row["setting"])], timings[ONE])
        found.append(at_least(f"tether: {words} over one run", 10.0, single))
        if method == "LSODA":
            found.append(at_least(f"tether: {words} over {BATCH} runs, a run", 100.0, float(row["over the batch"])))
    return found
