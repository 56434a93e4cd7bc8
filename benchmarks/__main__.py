"""Run the benchmarks: all sections, or those that are named."""

from __future__ import annotations

import os

# before NumPy is loaded: one thread, and the kernel that the library chooses for this processor
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")
for _name in ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"):
    os.environ.pop(_name, None)

import argparse
import time
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from benchmarks import (
    comparison,
    delays,
    figures,
    machine,
    processes,
    report,
    scaling,
    tethers,
    throughput,
    work_precision,
)
from benchmarks.verdicts import Verdict

FOLDER = Path("outputs/bench")
SECTIONS = {
    "throughput": "Certified evaluations a second, one core",
    "comparison": "The engine and its peers, one core, each at its own error",
    "work_precision": "The project's solvers, error and time per trajectory",
    "delays": "Delayed feedback and jitcdde, one core, each at its own error",
    "tethers": "A tether under FDA-SMC and SciPy's stiff integrators, one core, each at its own error",
    "processes": "Start-up, whole runs, memory",
    "scaling": "Surveys of millions of points: two workers against one process, memory of the parent",
}


def main() -> None:
    """Measure, print, and write outputs/bench/."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("section", nargs="*", help=f"{', '.join(SECTIONS)}; all unless named")
    chosen = parser.parse_args().section or list(SECTIONS)
    if unknown := set(chosen) - set(SECTIONS):
        parser.error(f"{', '.join(sorted(unknown))}: must be of {', '.join(SECTIONS)}")
    started, tables, verdicts, notes = time.perf_counter(), {}, [], []
    loads = {"before": machine.load()}
    for name in chosen:
        table, found, said = _measured(name)
        tables[name], loads[f"after {name}"] = table, machine.load()
        verdicts += found
        notes += said
        print(f"\n{SECTIONS[name]}\n\n{report.markdown(table)}", flush=True)
    facts = {"machine": machine.description(), "loads": loads, "seconds": time.perf_counter() - started}
    titled = {SECTIONS[name]: table for name, table in tables.items()}
    text = report.summary(verdicts, titled, machine.description(), loads, notes)
    report.write(FOLDER, verdicts, tables, text, facts)
    figures.write(FOLDER, _figures(tables))
    print(f"\n{report.markdown(report.verdict_table(verdicts))}\n", *notes, sep="\n")
    print(f"{facts['seconds']:.0f} s, load {loads['before']:.2g} to {machine.load():.2g}")
    print(FOLDER / "summary.md")


def _measured(name: str) -> tuple[pd.DataFrame, list[Verdict], list[str]]:
    """Return table, verdicts and notes of a section; those on one core keep this process there."""
    if name == "processes":
        return *processes.measure(), []
    if name == "scaling":
        return scaling.measure()
    with machine.one_core():
        if name == "throughput":
            return *throughput.measure(), []
        if name == "comparison":
            return comparison.measure()
        if name == "delays":
            return delays.measure()
        if name == "tethers":
            return tethers.measure()
        return work_precision.measure(), [], []


def _figures(tables: dict[str, pd.DataFrame]) -> dict[str, Figure]:
    drawn = {}
    if "throughput" in tables:
        drawn["throughput"] = figures.throughput(tables["throughput"])
    if {"work_precision", "comparison"} <= set(tables):
        drawn["work_precision"] = figures.work_precision(tables["work_precision"], tables["comparison"])
    return drawn


if __name__ == "__main__":
    main()
