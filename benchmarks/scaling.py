"""Large surveys: what a second process gains, and what the parent holds in memory."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks import machine
from benchmarks.processes import run
from benchmarks.verdicts import Verdict, at_least, at_most

LEAST_EFFICIENCY = 0.85
LARGEST_PARENT_MIB = 500e6 / 2.0**20

_USAGE = str(Path(__file__).with_name("usage.py"))
_REPEATS = 3
_WORKERS = 2
_GAINS = ("survey.axes.k_p_w='0.01:2.24:0.01'", "survey.axes.k_d_w='0.01:2.24:0.01'")
_ORDERS = {1_003_520: "survey.axes.alpha_w='0.81:1.00:0.01'", 2_007_040: "survey.axes.alpha_w='0.805:1.00:0.005'"}
"""Orders by the number of points that they make with 224 × 224 gains."""
_TIMED = "survey.axes.alpha_w='0.705:1.00:0.005'"
"""Orders of a survey that takes one process 20 seconds or more: 3 010 560 points."""
_SCHEDULERS = {
    "one process": ("scheduler=serial",),
    "2 local workers": ("scheduler=local", f"scheduler.workers={_WORKERS}"),
    "2 Dask workers": ("scheduler=dask", f"scheduler.workers={_WORKERS}"),
}


def measure() -> tuple[pd.DataFrame, list[Verdict], list[str]]:
    """Time surveys of 3 million points, turn by turn, and weigh the parent at 1 and 2 million, with all figures.

    The efficiency of two workers is the time of one process over twice theirs, start and end of the command included.
    A busy machine spoils it: the table has the load beside the CPU time.
    """
    with tempfile.TemporaryDirectory() as folder:
        timed = _take_turns(folder, ["survey=out_of_plane", _TIMED, *_GAINS, "figures=null"])
        rows = [_row(f"3 010 560 points, {name}", found) for name, found in timed.items()]
        weighed = {
            count: _used(folder, ["experiment=ic1_outofplane", orders, *_GAINS, *_SCHEDULERS["2 local workers"]])
            for count, orders in _ORDERS.items()
        }
    for count, found in weighed.items():
        rows.append(_row(f"{count:,} points, 2 local workers, cross-check and figures".replace(",", " "), [found]))
    seconds = {name: float(np.median([one[0] for one in found])) for name, found in timed.items()}
    gains = {name: seconds["one process"] / (_WORKERS * seconds[name]) for name in seconds if name != "one process"}
    verdicts = [at_least(f"efficiency of {name}", LEAST_EFFICIENCY, gain) for name, gain in gains.items()]
    peak = max(found[3] for found in weighed.values())
    verdicts.append(at_most("MiB of the parent of 2 million points (500 MB)", LARGEST_PARENT_MIB, peak))
    return pd.DataFrame(rows), verdicts, []


def _take_turns(folder: str, arguments: Sequence[str]) -> dict[str, list[list[float]]]:
    found: dict[str, list[list[float]]] = {name: [] for name in _SCHEDULERS}
    for _ in range(_REPEATS):
        for name, scheduler in _SCHEDULERS.items():
            found[name].append(_used(folder, [*arguments, *scheduler]))
    return found


def _used(folder: str, arguments: Sequence[str]) -> list[float]:
    """Return seconds, own CPU, workers' CPU, own peak, workers' peak."""
    output = run([_USAGE, "run", *arguments, f"output_dir={folder}", "--fresh", "--quiet"]).output
    return [float(word) for word in output.splitlines()[-1].split()]


def _row(what: str, found: Sequence[Sequence[float]]) -> dict[str, Any]:
    seconds, own, others, peak, peak_others = np.median(np.array(found), axis=0).tolist()
    return {
        "what": what,
        "seconds": seconds,
        "shortest": min(one[0] for one in found),
        "repeats": len(found),
        "parent CPU s": own,
        "workers CPU s": others,
        "parent MiB": peak,
        "worker MiB": peak_others,
        "load": machine.load(),
    }
