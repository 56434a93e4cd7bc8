"""What a user waits for and what a process needs: start-up, first calls, whole runs, memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks import machine
from benchmarks.verdicts import Verdict, at_most

LONGEST_EXPERIMENT_S = 60.0
_POINTS = ("survey.axes.alpha_w='0.81:1.00:0.01'", "survey.axes.k_p_w='0.02:2:0.02'", "survey.axes.k_d_w='0.02:2:0.02'")
"""20 × 100 × 100 design points."""
_WEIGH = Path(__file__).with_name("weigh.py")
_FIRST_CALL = """
import time
start = time.perf_counter()
import fracctl as fc
loop = fc.ClosedLoop(fc.plants.HCWOutOfPlane(), fc.controllers.PDAlpha(k_p=0.85, k_d=2.0, alpha=0.91))
imported = time.perf_counter()
fc.solve(loop, initial_state=[0.0, 0.002], horizon=12.0)
first = time.perf_counter()
fc.solve(loop, initial_state=[0.0, 0.002], horizon=12.0)
print(imported - start, first - imported, time.perf_counter() - first)
"""


@dataclass(frozen=True)
class Finished:
    """A process that has ended well."""

    seconds: float
    """On the clock."""
    peak_mib: float
    """Largest resident memory of the process, or of one that it started."""
    output: str


def run(command: Sequence[str], environment: Mapping[str, str] | None = None) -> Finished:
    """Run Python with arguments and wait.

    Raises:
        RuntimeError: the process failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        result, output = Path(folder, "result"), Path(folder, "output")
        with output.open("w", encoding="utf-8") as stream:
            weighed = [sys.executable, str(_WEIGH), str(result), sys.executable, *command]
            subprocess.run(
                weighed, stdout=stream, stderr=subprocess.STDOUT, env=dict(os.environ, **environment or {}), check=True
            )
        text = output.read_text(encoding="utf-8")
        code, seconds, peak = result.read_text(encoding="utf-8").split()
    if code != "0":
        raise RuntimeError(f"{' '.join(command)} ended with {code}: {text[-2000:]}")
    return Finished(float(seconds), float(peak) / (2.0**20 if sys.platform == "darwin" else 2.0**10), text)


def measure() -> tuple[pd.DataFrame, list[Verdict]]:
    """Time and weigh processes, on all cores; return the table and the verdict on the whole experiment."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [*_start_up(folder), *_first_calls(folder), *_surveys(folder)]
        experiment = _command_line(
            "fracctl run experiment=outofplane, with all figures, 2 workers",
            ["run", "experiment=outofplane", "scheduler.workers=2", f"output_dir={folder}", "--fresh", "--quiet"],
            repeats=3,
        )
    verdict = at_most(f"seconds of {experiment['what']}", LONGEST_EXPERIMENT_S, experiment["seconds"])
    return pd.DataFrame([*rows, experiment]), [verdict]


def _row(what: str, seconds: Sequence[float], peaks: Sequence[float] | None = None) -> dict[str, Any]:
    return {
        "what": what,
        "seconds": float(np.median(seconds)),
        "shortest": float(np.min(seconds)),
        "repeats": len(seconds),
        "peak MiB": float(np.median(peaks)) if peaks else float("nan"),
        "load": machine.load(),
    }


def _command_line(what: str, arguments: Sequence[str], repeats: int) -> dict[str, Any]:
    done = [run(["-m", "fracctl", *arguments]) for _ in range(repeats)]
    return _row(what, [one.seconds for one in done], [one.peak_mib for one in done])


def _start_up(folder: str) -> list[dict[str, Any]]:
    single = ["run", f"output_dir={folder}", "--fresh", "--quiet"]
    return [
        _row("python -c pass", [run(["-c", "pass"]).seconds for _ in range(5)]),
        _command_line("fracctl --help", ["--help"], repeats=7),
        _command_line("fracctl run, one point, no figures", [*single, "figures=null"], repeats=5),
        _command_line("fracctl run, one point, with its figure", single, repeats=5),
    ]


def _first_calls(folder: str) -> list[dict[str, Any]]:
    """Time `import fracctl` and two solves, before and after numba has filled its cache on disk."""
    cache = {"NUMBA_CACHE_DIR": f"{folder}/numba"}
    table = np.array([[float(x) for x in run(["-c", _FIRST_CALL], cache).output.split()] for _ in range(6)])
    cold, warm = table[:1], table[1:]
    return [
        _row("import fracctl and build a loop", warm[:, 0].tolist()),
        _row("first fc.solve, nothing compiled yet", cold[:, 1].tolist()),
        _row("first fc.solve, compiled before", warm[:, 1].tolist()),
        _row("second fc.solve", warm[:, 2].tolist()),
    ]


def _surveys(folder: str) -> list[dict[str, Any]]:
    grid = ["run", "survey=out_of_plane", *_POINTS, "figures=null", f"output_dir={folder}", "--fresh", "--quiet"]
    return [_command_line("fracctl run, 200 000 points, one process", [*grid, "scheduler=serial"], repeats=3)]
